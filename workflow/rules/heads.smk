# Angles of the head: systems and controls that make them, their scores, and their models. Nothing here needs a body.

# Systems of other packages run in a process of their own, each with its controls, so that they cannot harm the others.
HEADS_TOGETHER = [name for name in HEADS if not CHOSEN.apart(name)]
HEADS_APART = [name for name, system in HEADS.items() if CHOSEN.apart(name) and system.drive == "own"]

# The scores of all draws of these systems, of one record.
HEAD_SCORES = f"{RESULTS}/evaluation/heads/{{record}}.parquet"


def head_scores_apart(system):
    """The scores of a system of another package and of its controls."""
    return f"{RESULTS}/evaluation/heads/{system}/{{record}}.parquet"


WRITTEN_WITH |= reported_with(HEADS_TOGETHER, HEAD_SCORES)


def melodies_of_fold(wildcards):
    """The pitch and intensity of all records of the actor of a fold."""
    return expand(f"{RESULTS}/speech/{{record}}/melody.parquet", record=records_of(actor_of(wildcards.record)))


def heads_of_fold(wildcards):
    """The angles of the head of these records."""
    return expand(f"{RESULTS}/head/{{record}}.parquet", record=records_of(actor_of(wildcards.record)))


def head_params(systems, apart):
    """The parameters of a job that runs systems that move the head."""
    return {
        "systems": systems,
        "apart": apart,
        "places": {
            system: (variant_of(system), f"{RESULTS}/synthesis/{system}/{variant_of(system)}") for system in systems
        },
        "tables": model_tables(systems),
        "actor": lambda wildcards: actor_of(wildcards.record),
        "records": lambda wildcards: records_of(actor_of(wildcards.record)),
        "shared": SHARED_SETTINGS,
        "own": own_settings(systems),
        "wrong": {"shift_s": SYNTHESIS["shift_s"], **config["evaluation"]["interior"]},
        "shown": next(iter(RECORDS)),
        "seed": config["seed"],
        "method_code": code_hash.modules_hash(
            [name for system in systems for name in (HEADS[system].method, HEADS[system].schemas) if name]
        ),
    }


rule heads:
    input:
        melodies=melodies_of_fold,
        heads=heads_of_fold,
    output:
        made=[made_by(system, "head.parquet") for system in HEADS_TOGETHER],
        scores=HEAD_SCORES,
    params:
        **head_params(HEADS_TOGETHER, apart=False),
    message:
        f"head of {{wildcards.record}} by {len(HEADS_TOGETHER)} systems"
    script:
        "../../scripts/synthesis/heads.py"


for name in HEADS_APART:

    rule:
        name:
            f"heads_{name}"
        input:
            melodies=melodies_of_fold,
            heads=heads_of_fold,
        output:
            made=[made_by(system, "head.parquet") for system in [name, *HEADS[name].controls]],
            scores=head_scores_apart(name),
        params:
            **head_params([name, *HEADS[name].controls], apart=True),
        message:
            f"head of {{wildcards.record}} by {name} and its controls"
        script:
            "../../scripts/synthesis/heads.py"


# The systems that move the whole body, whose heads are scored as well.
WHOLE = [name for name in makers(SYSTEMS, "motion") if "motion" in BRINGS and not CHOSEN.apart(name)]


# The recorded head itself at another moment: a control that no system can be, as none knows the record it is to make.
SHIFTED_HEAD = "original_shifted"


rule head_scores:
    input:
        scores=[
            path
            for table in [HEAD_SCORES, *map(head_scores_apart, HEADS_APART)]
            for path in expand(table, record=RECORDS)
        ],
        heads=expand(f"{RESULTS}/head/{{record}}.parquet", record=RECORDS),
        motions=[path for system in WHOLE for path in expand(made_by(system, "motion.parquet"), record=RECORDS)],
    output:
        scores=f"{RESULTS}/evaluation/head_scores.parquet",
        sessions=f"{RESULTS}/evaluation/head_sessions.parquet",
    params:
        actors={record: actor_of(record) for record in RECORDS},
        whole=[(system, variant_of(system), record) for system in WHOLE for record in RECORDS],
        systems={
            **{name: (CHOSEN.systems[name].role, list(CHOSEN.systems[name].controls)) for name in [*HEADS, *WHOLE]},
            SHIFTED_HEAD: ("control", []),
        },
        shifted=SHIFTED_HEAD,
        shift_s=SYNTHESIS["shift_s"],
        bootstrap=config["evaluation"]["bootstrap"],
        seed=config["seed"],
    message:
        f"scores of {len(RECORDS)} heads by {len(HEADS) + len(WHOLE)} systems"
    script:
        "../../scripts/evaluation/head_scores.py"


# Models for speech that is in no corpus, trained on all records of an actor, or without the record of a fold.
HEADS_MODELLED = [name for name, system in HEADS.items() if system.drive == "own" and not CHOSEN.apart(name)]

if "audio" in BRINGS:
    MODELS += [f"{RESULTS}/models/{name}/{variant_of(name)}/{actor}" for name in HEADS_MODELLED for actor in ACTORS]


def records_of_model(wildcards):
    """The actor of a model, the record it leaves out (None: none), and the records it is trained on."""
    held_out = wildcards.trained.removeprefix("fold~") if wildcards.trained.startswith("fold~") else None
    actor = actor_of(held_out) if held_out else wildcards.trained
    return actor, held_out, others(held_out) if held_out else records_of(actor)


rule head_model:
    input:
        melodies=lambda wildcards: expand(
            f"{RESULTS}/speech/{{record}}/melody.parquet",
            record=records_of_model(wildcards)[2],
        ),
        heads=lambda wildcards: expand(f"{RESULTS}/head/{{record}}.parquet", record=records_of_model(wildcards)[2]),
    output:
        folder=directory(f"{RESULTS}/models/{{system}}/main/{{trained}}"),
    wildcard_constraints:
        system="|".join(HEADS_MODELLED),
        trained=f"(fold~)?{record_list.NAME}",
    params:
        actor=lambda wildcards: records_of_model(wildcards)[0],
        held_out=lambda wildcards: records_of_model(wildcards)[1],
        records=lambda wildcards: records_of_model(wildcards)[2],
        shared=SHARED_SETTINGS,
        own=lambda wildcards: own_settings([wildcards.system]),
        method_code=lambda wildcards: code_hash.modules_hash([HEADS[wildcards.system].method]),
        card={
            "speech": config["speech"],
            "seed": config["seed"],
            **{key: ANIMATION[key] for key in ("continuity_weight", "smoothing")},
        },
    message:
        "model of {wildcards.system} for {wildcards.trained}"
    script:
        "../../scripts/synthesis/head_model.py"


# The system whose patterns of head and melody all others share: one actor's model is driven by another actor's voice.
NODDER = next((name for name in HEADS_MODELLED if "head_patterns" in HEADS[name].tables), None)
TRANSPLANTED_HEADS = TRANSPLANTS if NODDER and "audio" in BRINGS else []


def place_of_patterns(system):
    """The folder with the tables of a system's models, of which the job of its scores writes one for each record."""
    return f"{RESULTS}/synthesis/{system}/{variant_of(system)}"


if TRANSPLANTED_HEADS:

    rule head_transplant:
        input:
            model=f"{RESULTS}/models/{NODDER}/main/{{actor}}",
            audio=f"{RESULTS}/corpus/audio/{{record}}.wav",
        output:
            head=f"{RESULTS}/transplant/{{actor}}/{{record}}/head.parquet",
        params:
            seed=config["seed"],
            method_code=code_hash.modules_hash([HEADS[NODDER].method]),
        message:
            "head of {wildcards.record}, driven through the model of {wildcards.actor}"
        script:
            "../../scripts/synthesis/head_transplant.py"

    rule head_transplants:
        input:
            own=[expand(made_by(NODDER, "head.parquet"), record=record)[0] for _, record in TRANSPLANTED_HEADS],
            transplanted=[
                f"{RESULTS}/transplant/{actor}/{record}/head.parquet" for actor, record in TRANSPLANTED_HEADS
            ],
            models=[f"{RESULTS}/models/{NODDER}/main/{actor}" for actor, _ in TRANSPLANTED_HEADS],
            melodies=[f"{RESULTS}/speech/{record}/melody.parquet" for _, record in TRANSPLANTED_HEADS],
            heads=expand(f"{RESULTS}/head/{{record}}.parquet", record=RECORDS),
        output:
            table=f"{RESULTS}/evaluation/head_transplant.parquet",
        params:
            records=list(RECORDS),
            pairs=[
                {
                    "record": record,
                    "voice_actor": actor_of(record),
                    "model_actor": actor,
                    "own_model": f"{place_of_patterns(NODDER)}/{record}",
                    "own_records": others(record),
                    "other_model": f"{RESULTS}/models/{NODDER}/main/{actor}",
                    "other_records": records_of(actor),
                }
                for actor, record in TRANSPLANTED_HEADS
            ],
            system=NODDER,
            variant=variant_of(NODDER),
        message:
            "one actor's model of the head under another actor's voice"
        script:
            "../../scripts/evaluation/head_transplants.py"


# The records whose heads are shown: some of those of a corpus of heads, and one where there are bodies to watch.
PORTRAYED = list(RECORDS)[:1] if SYSTEMS else list(RECORDS)[:4]

# The heads next to the original: those of the first systems, and of the first one that hears its speech at the wrong
# moment.
LISTENING = [name for name in [*HEADS_TOGETHER, *HEADS_APART] if HEADS[name].role == "system"][:3]
HEADS_SHOWN = [*LISTENING, *(HEADS[name].controls[-1] for name in LISTENING[:1])]


# The equations that are read otherwise than printed, on the first record and the patterns learnt without it.
READ_RECORD = list(RECORDS)[0]
if HEADS_SHOWN and "curves" in HEADS[HEADS_SHOWN[0]].reports:

    rule head_readings:
        input:
            made=expand(made_by(HEADS_SHOWN[0], "head.parquet"), record=READ_RECORD),
            melody=f"{RESULTS}/speech/{READ_RECORD}/melody.parquet",
            head=f"{RESULTS}/head/{READ_RECORD}.parquet",
            accuracy=f"{RESULTS}/capture/head/accuracy.parquet" if VIRTUAL and FILMED_HEADS else [],
        output:
            table=f"{RESULTS}/evaluation/head_readings.parquet",
        params:
            patterns=f"{place_of_patterns(HEADS_SHOWN[0])}/{READ_RECORD}/head_patterns.parquet",
            curves=f"{place_of_patterns(HEADS_SHOWN[0])}/{READ_RECORD}/curves.parquet",
            seed=config["seed"],
        message:
            "equations of Sargin 2006 as printed and as read"
        script:
            "../../scripts/evaluation/head_readings.py"


def film_of_head(wildcards):
    """The film of a head, as the left camera sees it."""
    return RECORDS[wildcards.record]["film_left"] or []


rule portraits:
    input:
        original=f"{RESULTS}/head/{{record}}.parquet",
        heads=[made_by(system, "head.parquet") for system in HEADS_SHOWN],
        audio=f"{RESULTS}/corpus/audio/{{record}}.wav" if "audio" in BRINGS else [],
        film=film_of_head if "head" in BRINGS else [],
    output:
        video=f"{RESULTS}/animation/{{record}}/heads.mp4",
        strip=f"{RESULTS}/animation/{{record}}/heads.png",
    params:
        settings={key: ANIMATION["video"][key] for key in ("fps", "height_px", "longest_s")},
        titles=["original", *HEADS_SHOWN],
    message:
        f"video of the head of {{wildcards.record}}: original, {', '.join(HEADS_SHOWN)}"
    script:
        "../../scripts/rendering/portraits.py"


if VIRTUAL and FILMED_HEADS:

    rule head_capture:
        input:
            planted=expand(f"{RESULTS}/corpus/truth/head~{{record}}.parquet", record=FILMED_HEADS),
            found=expand(f"{RESULTS}/capture/head/{{record}}/pose.parquet", record=FILMED_HEADS),
        output:
            errors=f"{RESULTS}/evaluation/head_capture.parquet",
        params:
            actors={record: actor_of(record) for record in FILMED_HEADS},
        message:
            f"errors of the captured heads of {len(FILMED_HEADS)} records"
        script:
            "../../scripts/evaluation/head_capture.py"


if TRANSPLANTED_HEADS:

    rule transplant_portraits:
        input:
            original=f"{RESULTS}/head/{{record}}.parquet",
            heads=[made_by(NODDER, "head.parquet"), f"{RESULTS}/transplant/{{actor}}/{{record}}/head.parquet"],
            audio=f"{RESULTS}/corpus/audio/{{record}}.wav",
            film=[],
        output:
            video=f"{RESULTS}/transplant/{{actor}}/{{record}}/heads.mp4",
            strip=f"{RESULTS}/transplant/{{actor}}/{{record}}/heads.png",
        params:
            settings={key: ANIMATION["video"][key] for key in ("fps", "height_px", "longest_s")},
            titles=lambda wildcards: ["original", "own model", f"model of {wildcards.actor}"],
        message:
            "video of the head of {wildcards.record}: original, own model, model of {wildcards.actor}"
        script:
            "../../scripts/rendering/portraits.py"


rule pattern_poses:
    input:
        patterns=outputs_for(
            expand(made_by(system, "head_patterns.parquet"), record=list(RECORDS)[:1])[0]
            for system in HEADS_SHOWN[:1]
        ),
    output:
        picture=f"{RESULTS}/animation/head_patterns.png",
    params:
        patterns=[
            expand(made_by(system, "head_patterns.parquet"), record=list(RECORDS)[:1])[0]
            for system in HEADS_SHOWN[:1]
        ],
    message:
        "pictures of the patterns of the head"
    script:
        "../../scripts/rendering/pattern_poses.py"


if VIRTUAL and HAS_HEADS and HEADS_TOGETHER:

    # The first system that learns has the patterns of head and melody that all others share.
    PATTERNED = next(name for name in HEADS_TOGETHER if "head_patterns" in HEADS[name].tables)

    rule head_recovery:
        input:
            planted=f"{RESULTS}/corpus/truth/gesture_phrases.parquet",
            scores=expand(HEAD_SCORES, record=RECORDS),
            heads=expand(f"{RESULTS}/head/{{record}}.parquet", record=RECORDS),
            melodies=expand(f"{RESULTS}/speech/{{record}}/melody.parquet", record=RECORDS),
        output:
            recovery=f"{RESULTS}/evaluation/head_recovery.parquet",
        params:
            actors={record: actor_of(record) for record in RECORDS},
            models=place_of_patterns(PATTERNED),
        message:
            "how much of the planted head gestures is found again"
        script:
            "../../scripts/evaluation/head_recovery.py"
