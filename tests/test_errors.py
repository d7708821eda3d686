"""Messages to users are one line, whatever they quote."""

from hypothesis import example, given
from hypothesis import strategies as st

from cospeech.errors import UserError


@given(st.text())
@example("a column called 'label\x0ba'")
@example("a\r\nb\x85c\u2028\n")
def test_a_message_is_one_line(text):
    message = str(UserError(text))
    assert len(message.splitlines()) <= 1
    if text.splitlines() == [text]:
        assert message == text


def test_line_breaks_are_written_as_escape_sequences():
    assert str(UserError("label\x0ba: no\nname")) == "label\\x0ba: no\\nname"
