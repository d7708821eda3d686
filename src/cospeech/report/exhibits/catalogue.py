"""Every exhibit of the report, in the order of the page, and what they share: sections, sources and conditions."""

from __future__ import annotations

from cospeech.report.exhibits.declaration import (
    LEVINE_2009,
    LEVINE_2010,
    OZKUL_2012,
    SARGIN_2006,
    Condition,
    Exhibit,
    Section,
    Source,
)

SECTIONS = (
    Section("speech", "From speech to gesture", "Speech"),
    Section("capture", "From film to joint angles", "Capture"),
    Section("watch", "Watch", "Watch"),
    Section("scores", "Scores", "Scores"),
    Section("every_world", "Every system in every world", "Worlds"),
    Section("voice", "Another voice", "Another voice"),
    Section("thesis", "The experiments of the thesis", "Thesis"),
    Section("controller", "The experiments on gesture controllers", "Gesture controllers"),
    Section("body_language", "The experiments on body language", "Body language"),
    Section("head", "Head gestures", "Head gestures"),
    Section("corpus", "The corpus", "Corpus"),
    Section("planted", "What was planted", "Planted"),
    Section("synchronisation", "Voice and lips", "Voice and lips"),
    Section("identification", "Error rates", "Error rates"),
    Section("gain", "What fusion gains", "Gain"),
    Section("events", "Keywords and accents in speech", "Speech events"),
    Section("gestures", "Gestures of hands and head", "Gestures"),
    Section("co_occurrence", "Speech and gestures at the same time", "Co-occurrence"),
    Section("animation", "From words and accents to movement", "Animation"),
)

CONDITIONS = (
    Condition("phrases", "the systems of this run move nothing but heads"),
    Condition("motion", "the corpus has gesture labels but no motion", also="videos"),
    Condition("sweep", "the configuration sweeps over no setting"),
    Condition("two_actors", "there is only one actor"),
    Condition("transplant", "no actor's model was driven by another actor's voice", also="videos of it"),
    Condition(
        "head_transplant",
        "no actor's model of the head was driven by another actor's voice",
        also="videos of such heads",
    ),
    Condition("takes", "no joint angles were computed from films or markers"),
    Condition("filmed", "there are no films"),
    Condition("all_filmed", "not all records were filmed"),
    Condition("controller_offline", "the configuration leaves out the offline gesture controller"),
    Condition("bodylanguage_random", "the configuration leaves out the controls of body language"),
    Condition("worlds", "there are no actors who live in different worlds"),
    Condition("heads", "the configuration chooses no system that moves the head, or the records lack head or melody"),
    Condition("head_curves", "the systems of heads report neither curves nor stages of generation"),
    Condition("filmed_heads", "no virtual head was filmed"),
    Condition("planted_heads", "no head gestures were planted"),
    Condition(
        "virtual", "real people were recorded, so nothing was planted", also="the ceilings that know what was planted"
    ),
)

IDENTITY_CONDITIONS = (Condition("populations", "the configuration asks for no further populations"),)

CONTROLLER = "synthesis/controller_offline/main"

BODY_LANGUAGE = "synthesis/bodylanguage/main/{first_record}"

FIRST_HEAD = "synthesis/{first_head.name}/{first_head.variant}/{first_record}"

SOURCES = {
    "records": Source("corpus/records.parquet", "records"),
    "annotations": Source("corpus/annotations.parquet", "annotations"),
    "cameras": Source("capture/cameras.parquet", "cameras"),
    "actual": Source("phrases/gesture/{record}.parquet", "segments"),
    "synthesised": Source(
        "synthesis/{pictured.name}/{pictured.variant}/{record}/{pictured.phrases_file}", "segments"
    ),
    "record_prosody": Source("speech/{first_record}/prosody.parquet", "prosody"),
    "record_clusters": Source("phrases/prosody/{setting}/fold~{first_record}/segments.parquet", "segments"),
    "record_actual": Source("phrases/gesture/{first_record}.parquet", "segments"),
    "record_synthesised": Source(
        "synthesis/{in_timeline.name}/{in_timeline.variant}/{first_record}/{in_timeline.phrases_file}", "segments"
    ),
    "decoding": Source("synthesis/{third_party.name}/{third_party.variant}/{record}/decoding.parquet", "decoding"),
    "record_scores": Source("evaluation/record_scores.parquet", "record_scores"),
    "session_scores": Source("evaluation/session_scores.parquet", "session_scores"),
    "differences": Source("evaluation/differences.parquet", "differences"),
    "motion_statistics": Source("evaluation/motion_statistics.parquet", "motion_statistics"),
    "motion_histograms": Source("evaluation/motion_histograms.parquet", "motion_histograms"),
    "motion_quality": Source("evaluation/motion_quality.parquet", "motion_quality"),
    "transplant": Source("evaluation/transplant.parquet", "transplant"),
    "recovery": Source("evaluation/recovery.parquet", "recovery"),
    "film_effect": Source("evaluation/film_effect.parquet", "film_effect"),
    "capture_scores": Source("capture/capture_scores.parquet", "capture_scores"),
    "observability": Source("capture/{captured}/observability.parquet", "observability"),
    "controller_windows": Source(f"{CONTROLLER}/{{record}}/windows.parquet", "controller_windows"),
    "controller_regret": Source(f"{CONTROLLER}/{{record}}/regret.parquet", "controller_regret"),
    "controller_control_layer": Source(
        f"{CONTROLLER}/{{first_record}}/control_layer.parquet", "controller_control_layer"
    ),
    "controller_libraries": Source("evaluation/controller_libraries.parquet", "controller_libraries"),
    "controller_strips": Source("evaluation/controller_strips.parquet", "controller_strips"),
    "subunit_library": Source(f"{BODY_LANGUAGE}/subunits.parquet", "subunit_library"),
    "subunit_clusters": Source(f"{BODY_LANGUAGE}/clusters.parquet", "subunit_clusters"),
    "observation_occurrences": Source(f"{BODY_LANGUAGE}/occurrences.parquet", "observation_occurrences"),
    "subunit_selections": Source(f"{BODY_LANGUAGE}/selections.parquet", "subunit_selections"),
    "elapsed_errors": Source(f"{BODY_LANGUAGE}/elapsed.parquet", "elapsed_errors"),
    "record_head": Source("head/{first_record}.parquet", "head"),
    "record_heads": Source("synthesis/{shown_head.name}/{shown_head.variant}/{first_record}/head.parquet", "head"),
    "head_sessions": Source("evaluation/head_sessions.parquet", "head_sessions"),
    "head_patterns": Source(f"{FIRST_HEAD}/head_patterns.parquet", "hmm_model"),
    "melody_patterns": Source(f"{FIRST_HEAD}/melody_patterns.parquet", "hmm_model"),
    "head_curves": Source(f"{FIRST_HEAD}/curves.parquet", "head_curves"),
    "head_generation": Source(f"{FIRST_HEAD}/generation.parquet", "head_generation"),
    "pattern_poses": Source("animation/head_patterns.png"),
    "head_strip": Source("animation/{first_record}/heads.png"),
    "head_capture": Source("evaluation/head_capture.parquet", "head_capture"),
    "head_accuracy": Source("capture/head/accuracy.parquet", "head_accuracy"),
    "head_transplant": Source("evaluation/head_transplant.parquet", "head_transplant"),
    "head_readings": Source("evaluation/head_readings.parquet", "head_readings"),
    "head_recovery": Source("evaluation/head_recovery.parquet", "head_recovery"),
    "rig_picture": Source("capture/rig.png"),
    "stills": Source("animation/stills.parquet", "stills"),
    "stills_picture": Source("animation/stills.png"),
    "strip_picture": Source("animation/strip.png"),
    "smoothing": Source("animation/smoothing.parquet", "smoothing_trial"),
    "clips": Source("identity/clips.parquet", "clips"),
    "delay": Source("identity/delay.parquet", "delay"),
    "delay_curve": Source("identity/delay_curve.parquet", "delay_curve"),
    "shift_rates": Source("identity/shift_rates.parquet", "shift_rates"),
    "canonical_correlations": Source("identity/canonical_correlations.parquet", "canonical_correlations"),
    "equal_error_rates": Source("identity/equal_error_rates.parquet", "equal_error_rates"),
    "det": Source("identity/det.parquet", "det"),
    "gains": Source("identity/gains.parquet", "gains"),
    "direction_scores": Source("directions/scores.parquet", "direction_scores"),
    "direction_records": Source("directions/records.parquet", "direction_records"),
    "direction_animation": Source("directions/animation.parquet", "direction_animation"),
    "direction_strip": Source("directions/strip.png"),
    "co_occurrence": Source("directions/co_occurrence.parquet", "co_occurrence"),
    "co_occurrence_pairs": Source("directions/co_occurrence_pairs.parquet", "co_occurrence_pairs"),
}
"""What exhibits and the page are made from.

Placeholders: ``record``, ``first_record`` (the one that is shown from speech to gesture), ``captured`` (records whose
joint angles come from films or markers), ``pictured``, ``in_timeline`` and ``third_party`` (systems, see ``Run``),
``first_head`` and ``shown_head`` (the system whose patterns are shown, and those whose heads are), and ``setting``
(the main setting of the prosody clusters, as a path).
"""

LABELS = "phrases.gesture.labels"
BINS_S = "evaluation.bins_s"

EXHIBITS = (
    Exhibit(
        "fig-timeline", "speech", "timeline:draw",
        sources={"prosody": "record_prosody", "clusters": "record_clusters", "actual": "record_actual",
                 "synthesised": "record_synthesised"},
        settings={"labels": LABELS, "voiced_gain": "speech.voiced_gain"},
        needs=("phrases",),
    ),
    Exhibit(
        "table-capture", "capture", "capture:accuracy", figure=False,
        sources={"scores": "capture_scores"},
        settings={"width_px": "studio.camera_width_px", "method": "capture.track.method"},
        needs=("filmed", "virtual"), show="capture:accuracy_table",
    ),
    Exhibit(
        "table-film-effect", "capture", "capture:film_effect", figure=False,
        sources={"effect": "film_effect"}, settings={"bins_s": BINS_S},
        needs=("phrases", "all_filmed", "virtual"), show="capture:accuracy_table",
    ),
    Exhibit(
        "fig-rig", "capture", "pictures:draw", numbers=False,
        sources={"picture": "rig_picture"}, needs=("filmed",),
    ),
    Exhibit(
        "table-observability", "capture", "capture:observability", figure=False,
        sources={"tables": "observability"}, needs=("takes",), show="capture:observability_table",
    ),
    Exhibit(
        "fig-6.4", "watch", "pictures:draw", document=OZKUL_2012, numbers=False,
        sources={"picture": "strip_picture"}, needs=("motion",),
    ),
    Exhibit(
        "fig-motion", "watch", "motion:speeds",
        sources={"statistics": "motion_statistics", "histograms": "motion_histograms"}, needs=("motion",),
    ),
    Exhibit(
        "table-motion-quality", "watch", "motion_quality:draw", figure=False,
        sources={"quality": "motion_quality"}, needs=("motion",), show="motion_quality:table",
    ),
    Exhibit(
        "leaderboard", "scores", "leaderboard:draw",
        sources={"scores": "session_scores"},
        show="leaderboard:boards", template="leaderboard.html.jinja",
        needs=("phrases",),
    ),
    Exhibit(
        "fig-differences", "scores", "differences:draw",
        sources={"differences": "differences"}, settings={"bins_s": BINS_S},
        needs=("phrases",),
    ),
    Exhibit(
        "worlds", "every_world", "worlds:draw",
        sources={"differences": "differences", "scores": "record_scores"}, settings={"studio": "studio"},
        needs=("phrases", "worlds"), show="worlds:table",
    ),
    Exhibit(
        "table-transplant",
        "voice",
        "transplant:draw",
        figure=False,
        sources={"transplant": "transplant"},
        needs=("transplant",),
        show="transplant:table",
    ),
    Exhibit(
        "fig-7.2a", "thesis", "sweep:clusters", document=OZKUL_2012,
        sources={"scores": "session_scores"}, needs=("sweep",),
        published="fig-7.2a", compare="sweep:best_clusters",
    ),
    Exhibit(
        "fig-7.2b", "thesis", "sweep:states", document=OZKUL_2012,
        sources={"scores": "session_scores"}, needs=("sweep",),
        published="fig-7.2b", compare="sweep:best_states",
    ),
    Exhibit(
        "fig-7.3", "thesis", "phrases:durations_of_first_actor", document=OZKUL_2012,
        sources={"actual": "actual", "synthesised": "synthesised"},
        settings={"labels": LABELS, "bins_s": BINS_S, "max_duration_s": "synthesis.max_duration_s"},
        needs=("phrases",),
    ),
    Exhibit(
        "fig-7.4", "thesis", "phrases:durations_of_second_actor", document=OZKUL_2012,
        sources={"actual": "actual", "synthesised": "synthesised"},
        settings={"labels": LABELS, "bins_s": BINS_S, "max_duration_s": "synthesis.max_duration_s"},
        needs=("phrases", "two_actors"),
    ),
    Exhibit(
        "fig-7.5", "thesis", "phrases:frequencies", document=OZKUL_2012,
        sources={"actual": "actual", "synthesised": "synthesised"}, settings={"labels": LABELS},
        needs=("phrases",),
    ),
    Exhibit(
        "fig-6.3", "thesis", "motion:smoothing", document=OZKUL_2012,
        sources={"trial": "smoothing"}, needs=("motion",),
    ),
    Exhibit(
        "controller-fig-4", "controller", "controller:windows", document=LEVINE_2010,
        sources={"windows": "controller_windows"}, needs=("controller_offline",),
        published="controller-fig-4", compare="controller:compare_windows",
    ),
    Exhibit(
        "fig-regret", "controller", "controller:regret",
        sources={"regret": "controller_regret"}, needs=("controller_offline",),
    ),
    Exhibit(
        "table-control-layer", "controller", "controller:control_layer", figure=False,
        sources={"facts": "controller_control_layer"}, needs=("controller_offline",), show="controller:control_table",
        published="controller-text", compare="controller:compare_control",
    ),
    Exhibit(
        "controller-table-1", "controller", "controller:libraries", document=LEVINE_2010, figure=False,
        sources={"libraries": "controller_libraries"}, needs=("controller_offline", "virtual"),
        show="controller:library_table",
        published="controller-table-1", compare="controller:compare_libraries",
    ),
    Exhibit(
        "controller-fig-6", "controller", "controller:strips", document=LEVINE_2010,
        sources={"strips": "controller_strips"}, needs=("controller_offline", "virtual"),
    ),
    Exhibit(
        "body-language-table-2.1", "body_language", "body_language:subunits", document=LEVINE_2009, figure=False,
        sources={"library": "subunit_library"}, needs=("bodylanguage_random",), show="body_language:subunit_table",
        published="body-language-table-2.1", compare="body_language:compare_subunits",
    ),
    Exhibit(
        "body-language-table-3.1", "body_language", "body_language:occurrences", document=LEVINE_2009, figure=False,
        sources={"occurrences": "observation_occurrences"}, needs=("bodylanguage_random",),
        show="body_language:occurrence_table",
        published="body-language-table-3.1", compare="body_language:compare_occurrences",
    ),
    Exhibit(
        "fig-continuation", "body_language", "body_language:continuations",
        sources={"clusters": "subunit_clusters"}, needs=("bodylanguage_random",),
    ),
    Exhibit(
        "body-language-fig-5.2", "body_language", "body_language:selections", document=LEVINE_2009,
        sources={"selections": "subunit_selections"}, needs=("bodylanguage_random",),
    ),
    Exhibit(
        "table-elapsed", "body_language", "body_language:elapsed", figure=False,
        sources={"errors": "elapsed_errors"}, needs=("bodylanguage_random",), show="body_language:elapsed_table",
    ),
    Exhibit(
        "body-language-fig-6.1", "body_language", "pictures:draw", document=LEVINE_2009, numbers=False,
        sources={"picture": "strip_picture"}, needs=("bodylanguage_random",),
    ),
    Exhibit(
        "head-table-4.1", "head", "head_scores:board", document=SARGIN_2006,
        sources={"sessions": "head_sessions"}, needs=("heads",),
        show="head_scores:table", template="heads.html.jinja",
        published="head-table-4.1", compare="head_scores:compare",
    ),
    Exhibit(
        "fig-head-differences", "head", "head_scores:differences",
        sources={"sessions": "head_sessions"}, needs=("heads",),
    ),
    Exhibit(
        "fig-head-lag", "head", "head_scores:lags",
        sources={"sessions": "head_sessions"}, needs=("heads",),
    ),
    Exhibit(
        "head-fig-4.5", "head", "head_curves:generation", document=SARGIN_2006,
        sources={"stages": "head_generation"}, needs=("heads", "head_curves"),
    ),
    Exhibit(
        "head-fig-4.6", "head", "head_curves:heads", document=SARGIN_2006,
        sources={"curves": "head_curves"}, needs=("heads", "head_curves"),
        published="head-fig-4.6", compare="head_curves:compare",
    ),
    Exhibit(
        "head-fig-4.7", "head", "head_patterns:gestures", document=SARGIN_2006,
        sources={"patterns": "head_patterns"}, needs=("heads",),
        show="head_patterns:gesture_table",
        published="head-fig-4.6", compare="head_patterns:compare_gestures",
    ),
    Exhibit(
        "fig-head-poses", "head", "pictures:draw", numbers=False,
        sources={"picture": "pattern_poses"}, needs=("heads",),
    ),
    Exhibit(
        "head-fig-4.8", "head", "head_curves:melodies", document=SARGIN_2006,
        sources={"curves": "head_curves"}, needs=("heads", "head_curves"),
        published="head-fig-4.8", compare="head_curves:compare",
    ),
    Exhibit(
        "head-fig-4.9", "head", "head_patterns:melodies", document=SARGIN_2006,
        sources={"patterns": "melody_patterns"}, needs=("heads",),
        published="head-fig-4.8", compare="head_patterns:compare_melodies",
    ),
    Exhibit(
        "head-fig-4.10", "head", "head_curves:joints", document=SARGIN_2006,
        sources={"curves": "head_curves"}, needs=("heads", "head_curves"),
        published="head-fig-4.10", compare="head_curves:compare",
    ),
    Exhibit(
        "fig-head-timeline", "head", "head:timeline",
        sources={"original": "record_head", "made": "record_heads"}, needs=("heads",),
    ),
    Exhibit(
        "fig-head-strip", "head", "pictures:draw", numbers=False,
        sources={"picture": "head_strip"}, needs=("heads",),
    ),
    Exhibit(
        "table-head-capture", "head", "head:captured", figure=False,
        sources={"errors": "head_capture"}, needs=("filmed_heads",), show="head:captured_table",
    ),
    Exhibit(
        "table-head-accuracy", "head", "head:accuracy", figure=False,
        sources={"errors": "head_accuracy"}, needs=("filmed_heads",), show="head:accuracy_table",
    ),
    Exhibit(
        "fig-head-recovery", "head", "head:recovered",
        sources={"recovery": "head_recovery"}, needs=("heads", "planted_heads"), show="head:recovery_table",
    ),
    Exhibit(
        "table-head-readings", "head", "head:readings", document=SARGIN_2006, figure=False,
        sources={"readings": "head_readings"}, needs=("heads", "head_curves"), show="head:readings_table",
    ),
    Exhibit(
        "table-head-transplant", "head", "transplant:heads", document=SARGIN_2006, figure=False,
        sources={"transplant": "head_transplant"}, needs=("heads", "head_transplant"), show="transplant:head_table",
    ),
    Exhibit(
        "table-3-scenarios", "corpus", "corpus:scenarios", document=OZKUL_2012, figure=False,
        sources={"records": "records"}, show="corpus:scenario_table",
        published="table-3-scenarios", compare="corpus:compare_size",
    ),
    Exhibit(
        "table-4.1", "corpus", "corpus:gesture_classes", document=OZKUL_2012, figure=False,
        sources={"phrases": "actual"}, settings={"labels": LABELS}, show="corpus:class_table",
        published="table-4.1", compare="corpus:compare_classes",
        needs=("phrases",),
    ),
    Exhibit(
        "fig-4.3", "corpus", "pictures:stills", document=OZKUL_2012,
        sources={"picture": "stills_picture", "stills": "stills"}, needs=("motion",),
    ),
    Exhibit(
        "fig-recovery", "planted", "recovery:draw",
        sources={"recovery": "recovery"}, needs=("phrases", "virtual"), show="recovery:summary_table",
    ),
)  # fmt: skip

IDENTITY = (
    Exhibit(
        "identity-fig-2.1", "synchronisation", "identity:shifts", document=SARGIN_2006,
        sources={"curve": "delay_curve", "delay": "delay", "rates": "shift_rates"},
        published="identity-fig-2.1", compare="identity:compare_shifts",
    ),
    Exhibit(
        "identity-fig-2.2", "synchronisation", "identity:correlations", document=SARGIN_2006,
        sources={"correlations": "canonical_correlations"},
        published="identity-fig-2.2", compare="identity:compare_correlations",
    ),
    Exhibit(
        "identity-table-2.2", "identification", "identity:strategies", document=SARGIN_2006, figure=False,
        sources={"rates": "equal_error_rates"}, show="identity:strategy_table",
    ),
    Exhibit(
        "identity-table-2.1", "identification", "identity:schemes", document=SARGIN_2006, figure=False,
        sources={"rates": "equal_error_rates"}, show="identity:scheme_table", template="rates.html.jinja",
    ),
    Exhibit(
        "identity-controls", "identification", "identity:controls",
        sources={"rates": "equal_error_rates"},
    ),
    Exhibit(
        "identity-det", "identification", "identity:det",
        sources={"points": "det"},
    ),
    Exhibit(
        "identity-gains", "gain", "identity:gains",
        sources={"gains": "gains"}, needs=("populations",), show="identity:gain_table",
    ),
)  # fmt: skip
"""The exhibits of a run that identifies speakers. It has none of the others."""

DIRECTIONS = (
    Exhibit(
        "head-text-3-keywords", "events", "chapter3:keywords", document=SARGIN_2006, figure=False,
        sources={"scores": "direction_scores"}, show="chapter3:keyword_table",
        published="head-text-3-keywords", compare="chapter3:compare_keywords",
    ),
    Exhibit(
        "head-table-3.1", "events", "chapter3:accents", document=SARGIN_2006,
        sources={"scores": "direction_scores"}, show="chapter3:accent_table",
        published="head-table-3.1", compare="chapter3:compare_accents",
    ),
    Exhibit(
        "head-text-3-gestures", "gestures", "chapter3:gestures", document=SARGIN_2006,
        sources={"scores": "direction_scores"}, show="chapter3:gesture_table",
        published="head-text-3-gestures", compare="chapter3:compare_gestures",
    ),
    Exhibit(
        "head-text-3-cooccurrence", "co_occurrence", "chapter3:co_occurrence", document=SARGIN_2006,
        sources={"measures": "co_occurrence", "pairs": "co_occurrence_pairs"},
        show="chapter3:co_occurrence_table",
        published="head-text-3-cooccurrence", compare="chapter3:compare_co_occurrence",
    ),
    Exhibit(
        "head-fig-3.2", "animation", "pictures:draw", document=SARGIN_2006, numbers=False,
        sources={"picture": "direction_strip"},
    ),
    Exhibit(
        "head-text-3-animation", "animation", "chapter3:animation", document=SARGIN_2006,
        sources={"animation": "direction_animation"},
        published="head-text-3-animation", compare="chapter3:compare_animation",
    ),
)  # fmt: skip
"""The exhibits of a run about route directions. It has none of the others."""
