"""A configuration file says what it seems to say, or one line names the place where it does not."""

from pathlib import Path

import pytest

from cospeech.errors import UserError
from cospeech.workflow import config_file

ROOT = Path(__file__).parents[2]

BOMB = "a0: &a0 [x, x]\n" + "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 9))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "contains no settings"),
        ("- a\n- b\n", "contains no settings"),
        ("just text\n", "contains no settings"),
        ("run: x\nstudio: [1\n", "line 3: not valid YAML"),
        ("run:\n\tx: 1\n", "line 2: not valid YAML"),
        (b"run: x\ntitle: \xe9\n", "line 2: not in UTF-8"),
        ("run: a\nseed: 1\nrun: b\n", "line 3: 'run' is given twice"),
        ("studio: {film: true, film: false}\n", "line 1: 'film' is given twice"),
        ('{"run": "a",\n"run": "b"}', "line 2: 'run' is given twice"),
        ("run: a\n---\nrun: b\n", "line 2: a second document begins"),
        ("run: " + "[" * 5000 + "]" * 5000, "line 1: more than 50 lists or mappings inside one another"),
        ("run: " + "{a: " * 5000 + "1" + "}" * 5000, "line 1: more than 50 lists"),
        ("run: &r\n  a: *r\n", "line 2: *r refers to the value that contains it"),
        ("&top\nrun: x\nstudio: *top\n", "line 3: *top refers to the value that contains it"),
        (BOMB, "line 7: more than 1,000,000 values once aliases are replaced"),
        ("run: !!python/object:os.system x\n", "line 1: not valid YAML"),
        ("seed: 010\n", "line 1: YAML reads 010 in base 8 or 60"),
        ("seed: 1\nstart_s: 1:30\n", "line 2: YAML reads 1:30 in base 8 or 60"),
        ("run: 2024-13-01\n", "not valid YAML (month must be in 1..12); correct it, or put the value in quotes"),
        ("? [a]\n: 1\n", "not valid YAML"),
    ],
)
def test_mistakes_are_named_in_one_line(tmp_path, text, complaint):
    path = tmp_path / "mine.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(UserError) as caught:
        config_file.check(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "a: 0\nb: 0.5\nc: '010'\nd: 1e3\ne: -0\n",
        "x: &x {a: 1}\ny: {<<: *x, b: 2}\nz: {<<: *x, b: 2}\nlist: [*x, *x]\n",
        "records: [{record: a}, {record: a}]\n",
        '{"run": "a", "studio": {"film": true}}',
    ],
)
def test_what_is_clear_is_accepted(tmp_path, text):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    config_file.check(path)


@pytest.mark.parametrize("path", sorted((ROOT / "config").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_configuration_that_we_ship_is_clear(path):
    config_file.check(path)
