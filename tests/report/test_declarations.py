"""Declarations of exhibits: complete, light to import, and free of what belongs elsewhere."""

import re
import subprocess
import sys

import plausible
import pytest
import yaml
from plausible import ROOT, RUN

from cospeech.data import tables
from cospeech.report import exhibits
from cospeech.report.exhibits import declaration
from cospeech.report.exhibits.declaration import Exhibit, Source

CODE = sorted((ROOT / "src/cospeech/report").rglob("*.py"))
TEXTS = [*CODE, ROOT / "workflow/rules/report.smk", *sorted((ROOT / "reports/template").rglob("*.jinja"))]


def test_importing_the_declarations_loads_neither_pandas_nor_matplotlib():
    code = (
        "import sys; import cospeech.report.exhibits, cospeech.report.systems;"
        "print(sorted({'numpy', 'pandas', 'matplotlib'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


@pytest.mark.parametrize(
    "exhibit", [*exhibits.EXHIBITS, *exhibits.IDENTITY, *exhibits.DIRECTIONS], ids=lambda exhibit: exhibit.name
)
def test_a_declaration_names_what_exists(exhibit):
    for function in filter(None, (exhibit.draw, exhibit.show, exhibit.compare)):
        assert callable(declaration.load(function))
    assert set(exhibit.sources.values()) <= set(exhibits.SOURCES)
    conditions = (*exhibits.CONDITIONS, *exhibits.IDENTITY_CONDITIONS)
    assert set(exhibit.needs) <= {condition.name for condition in conditions}
    assert exhibit.section in {section.anchor for section in exhibits.SECTIONS}
    assert (exhibit.compare is None) == (exhibit.published is None)
    assert exhibit.published is None or exhibit.published in RUN.published
    config = yaml.safe_load((ROOT / "config/demo.yaml").read_text(encoding="utf-8"))
    for path in exhibit.settings.values():
        exhibits.setting(config, path)
    assert exhibit.files


def test_exhibits_and_captions_are_one_to_one():
    captions = {path.stem for path in (ROOT / "reports/template/captions").glob("*.rst")}
    names = [exhibit.name for exhibit in (*exhibits.EXHIBITS, *exhibits.IDENTITY, *exhibits.DIRECTIONS)]
    assert sorted(names) == sorted(captions)


def test_sources_have_a_schema_unless_they_are_pictures():
    for source in exhibits.SOURCES.values():
        assert source.schema is not None or source.path.endswith(".png")
        assert source.schema is None or tables.schema(source.schema)


def test_a_path_is_filled_in_system_by_system():
    source = Source("synthesis/{pictured.name}/{pictured.variant}/{record}/{pictured.phrases_file}", "segments")
    names = {"pictured": [plausible.SYSTEMS["hsmm"], plausible.SYSTEMS["original"]], "record": ["a", "b"]}
    assert source.paths(names) == [
        "synthesis/hsmm/clusters~8,states~3/a/phrases.parquet",
        "synthesis/hsmm/clusters~8,states~3/b/phrases.parquet",
        "synthesis/original/main/a/phrases_seen.parquet",
        "synthesis/original/main/b/phrases_seen.parquet",
    ]


def test_a_run_has_what_it_meets_the_conditions_of():
    every = [condition.name for condition in exhibits.CONDITIONS]
    assert exhibits.of_run(every) == list(exhibits.EXHIBITS)
    assert exhibits.absent(every) == []
    nothing = {exhibit.name for exhibit in exhibits.of_run([])}
    missing = [name for _, names in exhibits.absent([]) for name in names]
    assert nothing | set(missing) >= {exhibit.name for exhibit in exhibits.EXHIBITS}
    assert nothing.isdisjoint(missing)
    assert len(missing) == len(set(missing))


def test_files_follow_from_the_declaration():
    exhibit = Exhibit("fig-1", "scores", "x:y", numbers=False)
    assert exhibit.files == ["figures/fig-1.svg", "figures/fig-1.png"]
    exhibit = Exhibit("table-1", "scores", "x:y", figure=False)
    assert exhibit.files == ["tables/table-1.csv"]


def test_no_system_is_named():
    # Words that are also names of systems: 'another' is English, 'random' a technical term.
    names = set(plausible.DECLARED) - {"another", "random"}
    for path in TEXTS:
        text = path.read_text(encoding="utf-8")
        assert re.findall(rf"\b({'|'.join(names)})\b", text) == [], path
        assert re.findall(r"""["'](another|random)["']""", text) == [], path


def test_published_numbers_are_in_one_place():
    def numbers(facts):
        for fact in facts.values() if isinstance(facts, dict) else facts:
            if isinstance(fact, dict | list):
                yield from numbers(fact)
            elif isinstance(fact, int | float):
                yield f"{abs(fact):g}"

    # Shorter numbers occur by chance.
    found = {number for number in numbers(RUN.published) if len(number.replace(".", "").lstrip("0")) >= 3}
    assert {"0.8313", "1.0714", "1.06", "1392"} <= found
    found |= {f"{RUN.published['fig-7.2a']['best_S']:.2f}"}
    for path in TEXTS:
        text = path.read_text(encoding="utf-8")
        assert [number for number in found if re.search(rf"(?<![\d.]){re.escape(number)}(?!\d)", text)] == [], path
