"""Whatever Praat may write as the label of an interval is read back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.errors import UserError
from cospeech.formats import textgrid

labels = st.text(
    st.sampled_from('ab ö"!<>[]=1.5\n\t') | st.characters(exclude_characters="\r\0", exclude_categories=["Cs"]),
    max_size=12,
)
names = st.text(st.characters(exclude_categories=["Cc", "Cs"]), min_size=1, max_size=8)


def test_a_message_about_a_text_with_line_breaks_is_one_line(tmp_path):
    (tmp_path / "a.TextGrid").write_text('"ooTextFile" "TextGrid" 0 9 <exists> 1 "IntervalTier" "a\n\nb" "c\nd"')
    with pytest.raises(
        UserError, match=r"a\.TextGrid: xmin of tier 'a b' is missing \(the text 'c d' stands there\)"
    ):
        textgrid.read(tmp_path / "a.TextGrid")


def written(text):
    return '"' + text.replace('"', '""') + '"'


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.tuples(names, st.lists(st.tuples(st.floats(0, 1e6), labels), max_size=5)), max_size=4),
    st.sampled_from(["utf-8", "utf-16"]),
    st.booleans(),
)
def test_any_labels_are_read_back(tmp_path_factory, tiers, encoding, short):
    lines = ['"ooTextFile"', '"TextGrid"', "0", "1e6", "<exists>", str(len(tiers))]
    for name, rows in tiers:
        lines += ['"IntervalTier"', written(name), "0", "1e+06", str(len(rows))]
        for time_s, label in rows:
            lines += [repr(time_s), "  1000000 ", written(label)]
    if not short:
        lines = [f"intervals [{number}]: x = {line}" for number, line in enumerate(lines)]
    path = tmp_path_factory.mktemp("labels") / "a.TextGrid"
    path.write_bytes("\n".join(lines).encode(encoding))
    grid = textgrid.read(path)
    assert (grid.start_s, grid.end_s) == (0.0, 1e6)
    assert [(name, [(row.start_s, row.end_s, row.label) for row in rows]) for name, rows in grid.tiers] == [
        (name, [(time_s, 1e6, label) for time_s, label in rows]) for name, rows in tiers
    ]
