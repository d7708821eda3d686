"""Everything wrong with a configuration is said in one line before any job starts."""

import copy
import math
import re
from datetime import date
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from cospeech.errors import MissingFileError, UserError
from cospeech.workflow import config as configuration
from cospeech.workflow import paths
from cospeech.workflow import records as record_list
from cospeech.workflow import sweep as settings
from cospeech.workflow import takes as capture_takes

ROOT = Path(__file__).parents[2]
DEMO = yaml.safe_load((ROOT / "config" / "demo.yaml").read_text())


def changed(**changes):
    """Return the demo's configuration with dotted keys set (double underscores for dots)."""
    config = copy.deepcopy(DEMO)
    for key, value in changes.items():
        place = config
        *way, last = key.split("__")
        for step in way:
            place = place[step]
        place[last] = value
    return config


def recorded(records):
    return changed(corpus__source="recorded", corpus__name="mine", corpus__records=records)


A = {"record": "a", "actor": "x", "motion": "a.bvh", "audio": "a.wav"}
B = {"record": "b", "actor": "x", "motion": "b.bvh", "audio": "b.wav"}


def cast(count=1, **keys):
    """Return the demo's configuration with ``count`` actors that have these keys."""
    actor = {"voice": "Male1", "records": 2, "duration_s": 60}
    return changed(studio__actors=[actor | {"actor": f"a{number}"} | keys for number in range(count)])


def in_worlds(*names):
    """Return actors who live in these worlds."""
    actor = {"voice": "Male1", "records": 2, "duration_s": 60}
    return [actor | {"actor": f"a{number}", "world": world} for number, world in enumerate(names)]


def calibrated(**keys):
    return changed(**{f"capture__calibration__{key}": value for key, value in keys.items()})


def overlay(base, top):
    for key, value in top.items():
        if isinstance(value, dict) and isinstance(base.get(key), dict):
            overlay(base[key], value)
        else:
            base[key] = value
    return base


@pytest.mark.parametrize("path", sorted((ROOT / "config").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_configuration_that_we_ship_is_valid(path):
    configuration.check(overlay(copy.deepcopy(DEMO), yaml.safe_load(path.read_text())))


@pytest.mark.parametrize(
    ("config", "complaint"),
    [
        (changed(speeech={}), "unknown key 'speeech'; did you mean 'speech'"),
        (changed(studio__couplng=1), "config: studio: unknown key 'couplng'; did you mean 'coupling'"),
        (changed(studio__coupling="high"), "config: studio.coupling: 'high' is not of type 'number'"),
        (changed(studio__coupling=1.5), "config: studio.coupling: 1.5 is greater than the maximum of 1"),
        (changed(studio__world="both"), "config: studio.world: 'both' is not one of"),
        (changed(studio__motion=True), "studio.motion: records with sound always have motion; set it to false"),
        (
            changed(studio__world="vigour", studio__sound=False, studio__film=False),
            "studio.world: 'vigour' is about how the body moves; set studio.motion to true",
        ),
        (changed(studio__couplings={"vigour": 0.5}), "studio.couplings are those of the parts of the world 'all'"),
        (cast(count=2, world="both"), "config: studio.actors.0.world: 'both' is not one of"),
        (cast(count=2, coupling=-1), "config: studio.actors.0.coupling: -1 is less than the minimum of 0"),
        (
            changed(studio__sound=False, studio__film=False, studio__actors=in_worlds("phrases", "syllables")),
            "studio.world: 'syllables' is about how the body moves; set studio.motion to true",
        ),
        (
            changed(studio__world="all", studio__couplings={"vigour": 0.5}, studio__actors=in_worlds("vigour")),
            "studio.couplings are those of the parts of the world 'all'",
        ),
        (
            changed(studio__film="stereo", studio__head_coupling=None),
            "studio.film: stereo films head gestures, and 'ada' has none",
        ),
        (changed(studio__head_coupling=1.5), "studio.head_coupling: 1.5 is greater than the maximum of 1"),
        (changed(studio__libraries={"table": 20}), "config: studio.libraries: unknown key 'table'"),
        (changed(phrases__prosody__clusters=0), "phrases.prosody.clusters: 0 is less than the minimum"),
        (changed(phrases__prosody__clusters=8.5), "phrases.prosody.clusters: 8.5 is not of type 'integer'"),
        (changed(synthesis__censoring="left"), "synthesis.censoring: 'left' is not one of"),
        (changed(speech__pitch_min_hz=500), "pitch_min_hz must be below"),
        (changed(speech__window_s=0.01), "window_s must be at least frame_s"),
        (changed(synthesis__max_duration_s=0.01), "at least two prosody frames"),
        (changed(phrases__gesture__labels=["left", "right"]), "must contain 'rest'"),
        (changed(evaluation__interior__head_s=60.0), "leaves nothing of a record"),
        (changed(corpus__name="mine"), "only the studio's"),
        (changed(corpus__markers__up="-z"), "up is '-z' and facing 'z'; they must lie along different axes"),
        (changed(corpus__markers__up="w"), "config: corpus.markers.up: 'w' is not one of"),
        (changed(corpus__markers__names={"left_hnd": "LHND"}), "no marker 'left_hnd'; did you mean 'left_hand'"),
        (changed(run=1), "config: run: YAML reads 1 as a number, not as text; write it in quotation marks"),
        (recorded([A | {"record": 7}]), "corpus.records.0.record: YAML reads 7 as a number, not as text"),
        (recorded([A | {"language": False}]), "corpus.records.0.language: YAML reads false as a truth value"),
        (recorded([A | {"actor": date(2024, 5, 1)}]), 'corpus.records.0.actor: YAML reads "2024-05-01" as a date'),
        (changed(run="a/b"), "config: run: 'a/b' is not a name"),
        (changed(studio__actors=[DEMO["studio"]["actors"][0]] * 2), "two actors have one name"),
        (changed(corpus__source="recorded", corpus__name="mine"), "corpus.records is empty"),
        (changed(run="demo\n"), "config: run: 'demo\\n' is not a name"),
        (changed(run="template"), "reports/template holds the templates"),
        (changed(**{"speeech\n": {}}), "unknown key 'speeech ';"),
        (changed(corpus__records="sheet.csv\n"), "config: corpus.records"),
        (changed(seed=math.nan), "config: seed: nan is not a finite number"),
        (changed(evaluation__bins_s=[0.1, math.inf]), "config: evaluation.bins_s.1: inf is not a finite number"),
        (changed(synthesis__systems={"mine": {"a": {"b": -math.inf}}}), "systems.mine.a.b: -inf is not a finite"),
        (changed(report__title=False), "report.title: YAML reads false as a truth value, not as text; write it"),
        (cast(records=10**9), "studio.actors.0.records: 1000000000 is greater than the maximum of 10000"),
        (cast(count=6000, records=2), "studio.actors: 12,000 records of 200 hours; at most 10,000 records"),
        (cast(records=1000, duration_s=4000), "studio.actors: 1,000 records of 1,111 hours"),
        (changed(phrases__gesture__iterations=1e9), "1000000000.0 is greater than the maximum"),
        (changed(speech__frame_s=1e-9), "config: speech.frame_s: 1e-09 is less than the minimum"),
        (changed(corpus__name="x" * 101), "config: corpus.name: 'xxx"),
        (changed(identity__population=True, identity__sheet="a.csv"), "population and sheet exclude each other"),
        (changed(directions__corpus=True, identity__population=True), "directions.corpus and identity exclude each"),
        (
            changed(directions__corpus=True, corpus__source="recorded", corpus__name="ours", corpus__records="a.csv"),
            "directions.corpus is the studio's",
        ),
        (changed(identity__sheet="a.csv"), "identity.sheet lists recorded clips; set corpus.source to recorded"),
        (
            changed(identity__population=True, studio__population__repetitions=1),
            "studio.population.repetitions: with one, nothing is left to test",
        ),
        (
            changed(identity__population=True, identity__populations__speakers=4),
            "studio.population.others: there are not 5 names of other speakers",
        ),
        (
            changed(identity__delay__regularisation=0),
            "config: identity.delay.regularisation: 0 is less than or equal",
        ),
        (changed(identity__controls=["silence"]), "config: identity.controls.0: 'silence' is not one of"),
        (calibrated(method="board", films="x"), "a board needs films, a folder, and board"),
        (calibrated(method="board", films="x", board="y"), "a board takes [], or one {origin_frame: ...}"),
        (calibrated(method="given"), "capture.calibration.file: name the TOML"),
        (calibrated(method="lidar"), "capture.calibration.method: 'lidar' is not one of"),
        (calibrated(facts=[{"from_frame": 1, "place_m": [0, 0, 0]}]), "capture.calibration.facts.0"),
        (
            changed(corpus__source="recorded", corpus__name="mine", corpus__records=[{"record": "a"}]),
            "'actor' is a required property",
        ),
    ],
)
def test_mistakes_are_named_in_one_line(config, complaint):
    with pytest.raises(UserError) as caught:
        configuration.check(config)
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


def test_actors_have_worlds_and_couplings_of_their_own_or_those_of_the_studio():
    studio = {"world": "all", "coupling": 0.8, "couplings": {"vigour": 0.5}, "head_coupling": None}
    actors = [{"actor": "a"}, {"actor": "b", "world": "vigour"}, {"actor": "c", "coupling": 0, "head_coupling": 1}]
    assert configuration.actor_worlds(studio | {"actors": actors}) == {
        "a": ("all", 0.8, {"vigour": 0.5}, None),
        "b": ("vigour", 0.8, {}, None),
        "c": ("all", 0, {}, 1),
    }


def test_whole_numbers_with_a_decimal_point_are_read_as_whole():
    given = changed(
        seed=5.0, phrases__prosody__clusters=4.0, sweep__states=[3.0, 5], evaluation__interior__head_s=3.0,
        animation__video__longest_s=20.0, synthesis__systems={"mine": {"count": 2.0, "share": 0.5}},
    )  # fmt: skip
    given["capture"]["calibration"]["facts"] = [{"from_frame": 1.0, "to_frame": 2, "place_m": [1.0, 0, 0]}]
    read = configuration.normalised(given)
    assert str(read["seed"]) == "5"
    assert str(settings.main_setting(read)) == "Setting(clusters=4, states=3)"
    assert str(read["sweep"]["states"]) == "[3, 5]"
    assert (
        str(read["capture"]["calibration"]["facts"]) == "[{'from_frame': 1, 'to_frame': 2, 'place_m': [1.0, 0, 0]}]"
    )
    assert str(read["synthesis"]["systems"]) == "{'mine': {'count': 2, 'share': 0.5}}"
    assert str(read["evaluation"]["interior"]["head_s"]) == "3.0"  # any number: nothing to change
    assert configuration.normalised(DEMO) == DEMO
    assert str(configuration.normalised(DEMO)) == str(DEMO)


def test_whole_numbers_can_be_names():
    given = changed(run=7, capture__offsets_s={1: 0.05, "r1": {2: 1}}, corpus__records=[{"record": 1, "actor": 2}])
    read = configuration.normalised(given)
    assert read["run"] == "7"
    assert read["capture"]["offsets_s"] == {"1": 0.05, "r1": {"2": 1}}
    assert read["corpus"]["records"] == [{"record": "1", "actor": "2"}]


def test_the_order_of_keys_does_not_matter():
    turned = dict(reversed(DEMO.items())) | {"phrases": dict(reversed(DEMO["phrases"].items()))}
    assert str(configuration.in_order(turned)) == str(configuration.in_order(DEMO))
    assert configuration.in_order(DEMO) == DEMO


def test_the_films_of_a_calibration_are_named_by_their_cameras(tmp_path):
    config = calibrated(films=str(tmp_path))
    assert capture_takes.calibration_films(DEMO) == {}
    with pytest.raises(UserError, match="no film lies there"):
        capture_takes.calibration_films(config)
    for name in ("c2.MP4", "c1.mov", "notes.txt"):
        (tmp_path / name).touch()
    found = {"c1": str(tmp_path / "c1.mov"), "c2": str(tmp_path / "c2.MP4")}
    assert capture_takes.calibration_films(config) == found
    (tmp_path / "c1.avi").touch()
    with pytest.raises(UserError, match="two films are called 'c1'"):
        capture_takes.calibration_films(config)


def test_a_run_that_only_calibrates_needs_no_record():
    config = calibrated(method="given", file="rig.toml")
    config["corpus"] |= {"source": "recorded", "name": "mine"}
    configuration.check(config)
    assert record_list.brings(record_list.records(config, "results/x")) == frozenset()


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a.bvh", "a.wav", "b.bvh", "b.wav", "p.csv"):
        Path(name).touch()


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ([A, A], "'a' is listed twice"),
        ([A], "actor 'x' has one record"),
        ([A, B | {"actor": "y"}], "has one record"),
        ([A, B | {"audio": "c.wav"}], "record 'b': no audio file c.wav"),
        ([A, B | {"start_s": 5, "end_s": 4}], "record 'b': end_s 4 is not after start_s 5"),
        ([A | {"actor": "all"}, B | {"actor": "all"}], "record 'a': 'all' stands for every actor"),
        ([A | {"scenario": "all"}, B], "record 'a': 'all' stands for every scenario"),
        ([A, B | {"record": "b" * 101}], "'bbbbbbbbbbbbbbbbbbbb...' is longer than 100 characters"),
        (
            [A, B | {"motion": "take{1}.bvh"}],
            r"record 'b': motion: take\{1\}\.bvh: Snakemake takes '\{1\}' in a path",
        ),
    ],
)
@pytest.mark.usefixtures("files")
def test_records_are_checked(given, complaint):
    with pytest.raises(UserError, match=complaint):
        record_list.records(recorded(given), "results/x")


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ([A, {k: v for k, v in B.items() if k != "audio"}], r"record 'b' has no audio \(or prosody\)"),
        ([A, {"record": "b", "actor": "x", "motion": "b.bvh", "prosody": "p.csv"}], "make two runs of them"),
        ([A, B | {"syllables": "p.csv"}], "record 'b': syllables are found in its audio; leave one of them out"),
    ],
)
@pytest.mark.usefixtures("files")
def test_a_corpus_is_uniform(given, complaint):
    with pytest.raises(UserError, match=complaint):
        record_list.brings(record_list.records(recorded(given), "results/x"))


@pytest.fixture
def captured(files):
    """Two records, one in films and one in markers, whose actor's range-of-motion take is in films too."""
    for folder in ("a", "range"):
        Path(folder).mkdir()
        for name in ("c2.MP4", "c1.mkv", "sound.wav", "._c1.mp4"):
            Path(folder, name).touch()
    Path("b.c3d").touch()
    config = recorded([
        {"record": "a", "actor": "x", "views": "a", "audio": "a.wav"},
        {"record": "b", "actor": "x", "motion": "b.c3d", "audio": "b.wav"},
    ])  # fmt: skip
    config["capture"] |= {"ranges": {"x": "range"}, "offsets_s": {"c1": 0.5, "range~x": {"c2": 1.0}}}
    config["capture"]["calibration"] |= {"method": "given", "file": "rig.toml"}
    return config


def test_films_and_markers_are_takes_and_so_are_the_ranges_of_motion(captured):
    listed = record_list.records(captured, "r")
    assert record_list.brings(listed) == {"motion", "audio"}
    assert capture_takes.takes(captured, listed, "r") == {
        "a": ["a/c1.mkv", "a/c2.MP4"], "b": ["b.c3d"], "range~x": ["range/c1.mkv", "range/c2.MP4"]
    }  # fmt: skip
    assert capture_takes.offsets_s(captured, "a") == {"c1": 0.5}
    assert capture_takes.offsets_s(captured, "range~x") == {"c1": 0.5, "c2": 1.0}
    takes = capture_takes.takes(DEMO, record_list.records(DEMO, "r"), "r")
    assert takes["range~ada"] == [f"r/corpus/raw/range~ada/c{number}.mkv" for number in range(1, 6)]
    assert set(takes) == {"ada_1", "deniz_1", "range~ada", "range~deniz"}
    others = {name for name, record in record_list.records(DEMO, "r").items() if record["motion"]}
    assert others == {f"{actor}_{number}" for actor in ("ada", "deniz") for number in (2, 3, 4)}
    every = changed(studio__filmed_records=None)
    assert len(capture_takes.takes(every, record_list.records(every, "r"), "r")) == 8 + 2
    unfilmed = changed(studio__film=False)
    assert capture_takes.takes(unfilmed, record_list.records(unfilmed, "r"), "r") == {}


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        ("ranges", {}, r"take, marker file or folder, in capture\.ranges\.x"),
        ("ranges", {"x": "nowhere"}, "nowhere: no such folder of films, and no marker file"),
        ("ranges", {"x": "none.trc"}, r"no marker file none\.trc"),
        ("ranges", {"x": "empty"}, "empty: no film lies there"),
        ("ranges", {"x": "twice"}, "twice: two films are called 'c1'"),
        ("offsets_s", {"a": {"c9": 1.0}}, r"capture\.offsets_s: no view is called 'c9'; views are c1, c2"),
        ("offsets_s", {"c9": 1.0}, r"capture\.offsets_s: no view is called 'c9'; views are b, c1, c2"),
        ("offsets_s", {"c": {"c1": 1.0}}, r"capture\.offsets_s: no take is called 'c'; takes are a, b, range~x"),
        ("calibration", DEMO["capture"]["calibration"], r"record 'a' comes as films, whose cameras must be known"),
    ],
)
def test_takes_that_cannot_be_captured_are_named(captured, key, value, complaint):
    Path("empty").mkdir()
    Path("twice").mkdir()
    for name in ("c1.mkv", "c1.mp4"):
        Path("twice", name).touch()
    captured["capture"][key] = value
    with pytest.raises(UserError, match=complaint):
        capture_takes.takes(captured, record_list.records(captured, "r"), "r")


@pytest.mark.usefixtures("files")
def test_a_record_has_one_kind_of_motion():
    with pytest.raises(UserError, match="record 'a' has both motion and views"):
        record_list.records(recorded([A | {"views": "a"}, B]), "r")


FACE = {"record": "a", "actor": "x", "film_left": "a.mkv", "audio": "a.wav"}
OTHER_FACE = FACE | {"record": "b", "film_left": "b.mkv", "audio": "b.wav"}


@pytest.fixture
def faces(files):
    """Films and a camera file of two records."""
    for name in ("a.mkv", "b.mkv", "right.mkv", "rig.toml"):
        Path(name).touch()


@pytest.mark.usefixtures("faces")
def test_the_focal_length_of_a_single_film_is_that_of_its_record_or_of_the_corpus():
    settings = recorded([FACE, OTHER_FACE | {"focal_px": 1250}])
    settings["capture"]["head"]["focal_35mm"] = 26
    listed = record_list.records(settings, "r")
    assert [(one["focal_px"], one["focal_35mm"]) for one in listed.values()] == [(None, 26), (1250, None)]
    Path("sheet.csv").write_text("record;actor;film_left;audio;focal_35mm\na;x;a.mkv;a.wav;26,5\nb;x;b.mkv;b.wav;24")
    settings = recorded("sheet.csv")
    assert [one["focal_35mm"] for one in record_list.records(settings, "r").values()] == [26.5, 24.0]


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({}, r"record 'a': the focal length of the camera of its film is not known; declare focal_35mm \(35 mm"),
        ({"focal_px": 900, "focal_35mm": 26}, "record 'a' has both focal_px and focal_35mm; leave one of them out"),
        (
            {"focal_px": 900, "film_cameras": "rig.toml"},
            "record 'a' has film_cameras as well; focal_px is for a sing",
        ),
        (
            {"focal_35mm": 26, "film_right": "right.mkv", "film_cameras": "rig.toml"},
            "record 'a' has film_cameras as well; focal_35mm is for a single film",
        ),
        ({"film_left": None, "motion": "a.bvh", "focal_px": 9}, "record 'a' has no film_left; focal_px is for a sin"),
    ],
)
@pytest.mark.usefixtures("faces")
def test_focal_lengths_that_are_missing_or_do_not_belong_are_refused(changes, complaint):
    with pytest.raises(UserError, match=complaint) as caught:
        record_list.records(recorded([FACE | changes, OTHER_FACE | {"focal_px": 900}]), "r")
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("files")
def test_a_sheet_without_records_is_refused():
    Path("sheet.csv").write_text("record,actor,motion,audio\n\n")
    with pytest.raises(UserError, match=r"sheet\.csv: lists no record"):
        record_list.records(recorded("sheet.csv"), "r")


@pytest.mark.usefixtures("files")
def test_a_sheet_in_csv_is_the_same_as_a_list():
    sheet = "record,actor,motion,audio,start_s,channel\na,x,a.bvh,a.wav,,2.0\nb,x,b.bvh,b.wav,1.5,\n"
    Path("sheet.csv").write_text(sheet)
    from_sheet = record_list.records(recorded("sheet.csv"), "r")
    assert from_sheet == record_list.records(recorded([A | {"channel": 2}, B | {"start_s": 1.5}]), "r")


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(("corpus", "expected"), [(None, {"a": 2, "b": None}), (1, {"a": 2, "b": 1})])
def test_the_channel_of_the_corpus_is_that_of_records_without_one(corpus, expected):
    settings = recorded([A | {"channel": 2}, B])
    settings["corpus"]["channel"] = corpus
    assert {name: record["channel"] for name, record in record_list.records(settings, "r").items()} == expected


SHEET = [A | {"start_s": 1.5}, B | {"start_s": 62.25, "end_s": 3600.0}]
CELLS = [[str(value) for value in (*A.values(), "1.5", "")], [*B.values(), "0:01:02.25", "1:00:00"]]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le"])
@pytest.mark.parametrize(("separator", "first", "end"), [
    (",", "", "\n"), (";", "", "\r\n"), ("\t", "", "\r"), (";", "sep=;\r\n", "\r\n"), (";", "", ";;\n\n;;;\n"),
])  # fmt: skip
@pytest.mark.usefixtures("files")
def test_sheets_of_spreadsheets_are_read(separator, first, end, encoding):
    rows = [[*A, "start_s", "end_s"], *CELLS]
    if separator != ",":
        rows = [[cell.replace(".25", ",25").replace("1.5", "1,5") for cell in row] for row in rows]
    Path("sheet.csv").write_bytes((first + "".join(separator.join(row) + end for row in rows)).encode(encoding))
    assert record_list.records(recorded("sheet.csv"), "r") == record_list.records(recorded(SHEET), "r")


@pytest.mark.usefixtures("files")
def test_times_in_a_list_may_be_written_with_colons():
    listed = record_list.records(recorded([A | {"start_s": "00:01:02.5"}, B]), "r")
    assert listed["a"]["start_s"] == 62.5
    with pytest.raises(UserError, match="record 'a': end_s 'late' is not a number of seconds or a time"):
        record_list.records(recorded([A | {"end_s": "late"}, B]), "r")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("record;actor;video\n", "unknown column 'video'"),
        ("Record;actor\n", "unknown column 'Record'; did you mean 'record'"),
        ("record,actor,start_s\na,x,nan\n", "line 2: start_s 'nan' is not a number"),
        ("record,actor,start_s\na,x,-1\n", "line 2: start_s is negative"),
        ("record,actor,focal_35mm\na,x,26 mm\n", "line 2: focal_35mm '26 mm' is not a number; write a number with"),
        ("record,actor,focal_px\na,x,-900\n", "line 2: focal_px -900 is not a focal length; write a positive"),
        ('record,actor,motion\na,x,"a\nb.bvh"\n', "line 2: the cell in column 'motion' contains a line break"),
        ('record,actor\n"a\n",x\n"b/c",x\n', "line 4: 'b/c' becomes part of a path"),
        ("record,actor,start_s\na,x,00:00:05:12\n", "a time code with a frame number"),
        ('record,"ac\ntor"\n', "the name of column 2, 'ac tor', contains a line break"),
        ("record,actor,actor\n", "two columns are called 'actor'"),
        ("\x00\x01\x00PK", "is not a text file"),
        ("record,actor,video\n", "unknown column 'video'"),
        ("record\na\n", "columns 'record' and 'actor' are needed"),
        ("record,actor,start_s\na,x,soon\n", "line 2: start_s 'soon' is not a number"),
        ("record,actor,channel\na,x,left\n", "line 2: channel 'left' is not a whole number; count channels from 1"),
        ("record,actor,channel\na,x,0\n", "line 2: channel '0' is not a whole number; count channels from 1"),
        ("record,actor\na,x,y\n", "line 2 has more cells"),
        ("record,actor\n,x\n", "line 2: needs a record and an actor"),
        ("record,actor\na/b,x\n", "line 2: 'a/b' becomes part of a path"),
    ],
)
def test_mistakes_in_a_sheet_are_named(tmp_path, text, complaint):
    sheet = tmp_path / "sheet.csv"
    sheet.write_text(text)
    with pytest.raises(UserError, match=complaint):
        record_list.records(recorded(str(sheet)), "r")


def test_a_missing_sheet_is_named():
    with pytest.raises(UserError, match=r"nowhere\.csv: cannot be read, there is no such file"):
        record_list.records(recorded("nowhere.csv"), "r")


def test_settings_of_the_sweep_leave_out_the_main_one():
    assert settings.main_setting(DEMO).path == "clusters~8/states~3"
    lines = settings.sweep_settings(DEMO)
    assert [setting.clusters for setting in lines if setting.states == 3] == [4, 6, 10, 12, 14, 16]
    assert [setting.states for setting in lines if setting.clusters == 8] == [5, 7, 9]
    assert len(lines) == 9
    full = settings.sweep_settings(changed(sweep__grid="full"))
    assert len(full) == 7 * 4 - 1
    assert settings.main_setting(DEMO) not in full


def test_studio_records_point_to_raw_files():
    listed = record_list.records(DEMO, "results/demo")
    assert len(listed) == 8
    assert listed["ada_1"]["audio"] == "results/demo/corpus/raw/ada_1.wav"
    assert record_list.brings(listed) == {"motion", "audio"}
    silent = record_list.records(changed(studio__sound=False), "results/demo")
    assert record_list.brings(silent) == {"gestures", "prosody", "syllables", "head", "melody"}
    without = record_list.records(changed(studio__sound=False, studio__head_coupling=None), "results/demo")
    assert record_list.brings(without) == {"gestures", "prosody", "syllables"}
    moving = record_list.records(changed(studio__sound=False, studio__motion=True), "results/demo")
    assert record_list.brings(moving) == {"motion", "prosody", "syllables", "head", "melody"}
    heads = record_list.records(changed(studio__sound=False, studio__world="patterns"), "results/demo")
    assert record_list.brings(heads) == {"head", "melody"}
    filmed = record_list.records(changed(studio__film="stereo"), "results/demo")
    assert record_list.brings(filmed) == {"head", "audio"}
    assert moving["ada_1"]["motion"] == "results/demo/corpus/raw/ada/ada_1.motion.parquet"


SYSTEMS = {
    name: SimpleNamespace(role=role, makes=makes)
    for name, role, makes in (
        ("listens", "system", "phrases"),
        ("moves", "system", "motion"),
        ("draws", "control", "phrases"),
    )
}


@pytest.mark.parametrize(
    ("animated", "shown", "systems", "complaint"),
    [
        (["draws"], "listens", SYSTEMS, "animation.video.shown: 'listens' is not in animation"),
        (["listens", "drws"], "listens", SYSTEMS, "animation.systems: 'drws' is not among the systems"),
        (["listens"], "listens", SYSTEMS, "animation.systems must contain a control"),
        (["draws"], "draws", {"draws": SYSTEMS["draws"]}, "chooses no system that listens to speech"),
    ],
)
def test_what_is_shown_is_among_the_systems(animated, shown, systems, complaint):
    config = changed(animation__systems=animated, animation__video__shown=shown)
    with pytest.raises(UserError, match=re.escape(complaint)):
        configuration.check_systems(config, systems)


def test_only_a_gesture_model_needs_the_class_rest():
    config = changed(phrases__gesture__labels=["left", "right"])
    configuration.check_labels(config, frozenset({"gestures", "prosody"}))
    configuration.check(overlay(config, {"corpus": recorded([A, B])["corpus"]}))
    with pytest.raises(UserError, match="labels must contain 'rest'"):
        configuration.check_labels(config, frozenset({"motion", "audio"}))


def test_what_makes_motion_need_not_be_named_to_be_shown():
    config = changed(animation__systems=["draws"], animation__video__shown=["moves"])
    configuration.check_systems(config, SYSTEMS)


def test_what_is_switched_off_or_left_out_is_not_shown():
    config = changed(animation__systems=["listens", "draws"], animation__video__shown=["moves", "listens"])
    config["synthesis"]["systems"] = {"listens": {}, "draws": {}, "moves": False}
    remaining = {name: system for name, system in SYSTEMS.items() if name != "moves"}
    configuration.check_systems(config, remaining)
    del config["synthesis"]["systems"]["moves"]
    with pytest.raises(UserError, match="'moves' is not in animation"):
        configuration.check_systems(config, remaining)


def test_what_could_not_be_loaded_can_be_named_and_is_not_missed():
    config = changed(animation__systems=["listens", "draws", "lost"], animation__video__shown=["lost", "moves"])
    configuration.check_systems(config, SYSTEMS, {"lost"})
    config = changed(animation__systems=["listens", "lost"], animation__video__shown="listens")
    with pytest.raises(UserError, match="must contain a control"):
        configuration.check_systems(config, SYSTEMS, {"lost"})


def test_transplants_name_actors_and_records():
    listed = {name: {"actor": name[0]} for name in ("a1", "a2", "b1", "b2")}
    assert record_list.transplants(DEMO, listed) == [("b", "a1")]
    assert record_list.transplants(DEMO, {"a1": {"actor": "a"}, "a2": {"actor": "a"}}) == []
    chosen = changed(transplant__pairs=[{"model": "a", "voice": "b2"}])
    assert record_list.transplants(chosen, listed) == [("a", "b2")]
    for pair, complaint in (
        ({"model": "c", "voice": "a1"}, "no actor is called 'c'; there are a, b"),
        ({"model": "a", "voice": "b3"}, "no record is called 'b3'"),
    ):
        with pytest.raises(UserError, match=complaint):
            record_list.transplants(changed(transplant__pairs=[pair]), listed)


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        ("clicks", "nowhere", "capture.clicks: no file or folder nowhere"),
        ("corrections", "nowhere", "capture.corrections: no file or folder nowhere"),
        ("file", "rig.toml", "capture.calibration.file: no file or folder rig.toml"),
    ],
)
def test_files_of_the_capture_must_exist(tmp_path, monkeypatch, key, value, complaint):
    monkeypatch.chdir(tmp_path)
    config = calibrated(method="given", file=value) if key == "file" else changed(**{f"capture__{key}": value})
    with pytest.raises(UserError, match=complaint):
        capture_takes.check_paths(config)
    Path(value).mkdir()
    capture_takes.check_paths(config)


def test_paths_are_relative_to_the_working_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("corpus").mkdir()
    for name in ("a.bvh", "a.wav", "b.bvh", "b.wav"):
        Path("corpus", name).touch()
    with pytest.raises(MissingFileError) as caught:
        record_list.records(recorded([A, B]), "r")
    said = paths.explain(caught.value, ["corpus/mine.yaml"])
    assert said.startswith(
        f"config: record 'a': no motion file a.bvh in {tmp_path}: paths are relative to the folder"
    )
    assert said.endswith("write corpus/a.bvh")
    monkeypatch.chdir("corpus")
    record_list.records(recorded([A, B]), "r")
