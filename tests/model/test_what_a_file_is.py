"""A file that is no model is called what it is, and what is suggested in place of a missing one has a like name."""

from __future__ import annotations

from pathlib import Path

import pytest

import gearrattle as gr


def told(path: Path) -> str:
    with pytest.raises(gr.ModelError) as caught:
        gr.load(path)
    assert len(caught.value.problems) == 1
    return str(caught.value.problems[0])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "an empty file"),
        (" \n\n", "an empty file"),
        ("# nothing yet\n", "a file without a key"),
        ('{"schema": 1, "inertia": []}', "a JSON file"),
        ('[\n  {"name": "a"}\n]', "a JSON file"),
        ("[inertia\nJ = 1", "not valid TOML"),
        ("{ not json", "not valid TOML"),
    ],
)
def test_a_file_that_is_no_model_is_called_what_it_is(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    assert said in told(path)


@pytest.mark.parametrize(
    ("missing", "there", "meant"),
    [
        ("csae3.toml", ("case3.toml", "comment.toml"), "case3.toml"),
        ("case3.tml", ("case3.toml", "case3.nc"), "case3.toml"),
        ("Case3.toml", ("case3.toml",), "case3.toml"),
        ("gearbox.toml", ("gearbox_2.toml",), "gearbox_2.toml"),
        ("case33.toml", ("comment.toml", "readme.toml"), ""),
        ("new.toml", ("old.toml", "two.toml"), ""),
        ("rig1.toml", ("rig2.uff", "rig3.nc"), ""),
    ],
)
def test_a_suggestion_has_a_like_name(tmp_path: Path, missing: str, there: tuple[str, ...], meant: str) -> None:
    for name in there:
        (tmp_path / name).write_text("", encoding="utf-8")
    message = told(tmp_path / missing)
    assert "no such file" in message
    assert (f'did you mean "{tmp_path / meant}"?' in message) if meant else ("did you mean" not in message)
