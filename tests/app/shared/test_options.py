"""The options that the command line and REST read from the source are those of `kin.IKOptions`."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import pytest

from app.cli.arguments.options import flag_of
from app.shared.options import declared
from kin import IKOptions, JointConstraints
from kin.ik.options import DEFAULTS

HINTS: dict[str, Any] = {
    **get_type_hints(JointConstraints, include_extras=True),
    **get_type_hints(IKOptions, include_extras=True),
}


def test_what_is_read_from_the_source_is_what_the_class_has():
    assert list(declared()) == list(DEFAULTS)
    for name, option in declared().items():
        hint = HINTS[name]
        assert option.choices == (get_args(hint) if get_origin(hint) is Literal else ()), name
        assert option.switch == (hint is bool), name
        assert option.unit == (hint.__metadata__[0].unit if get_origin(hint) is Annotated else ""), name
        assert option.default == (DEFAULTS[name] or option.default), name
        assert option.text[-1] not in " .", name


def test_reading_the_options_does_not_import_the_core():
    program = 'import sys, app.cli.parser as cli; cli.main(["ik", "--help"]); print("kin" in sys.modules)'
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("\nFalse\n")


@pytest.mark.parametrize("request_name", ["IkRequest", "SentIkRequest"])
def test_rest_describes_every_option_in_the_words_of_the_class(app, request_name):
    fields = app.openapi()["components"]["schemas"][request_name]["properties"]
    for name, option in declared().items():
        start = option.text.partition(". ")[0]
        assert start[1:] in fields[name]["description"], name
        if option.choices and name != "task":
            assert fields[name]["enum"] == list(option.choices)
            assert fields[name]["default"] == DEFAULTS[name]
        if option.unit:
            (allowed,) = HINTS[name].__metadata__
            number = fields[name]["anyOf"][0]
            assert (number["minimum"], number["maximum"]) == (allowed.least, allowed.most)


def test_the_command_line_has_a_flag_for_every_option(capsys):
    from app.cli import parser

    assert parser.main(["ik", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for name, option in declared().items():
        if name == "respect_limits":  # its flag says the opposite
            assert "--ignore-limits" in text
            continue
        assert f" {flag_of(name)} " in text, name
        assert option.text.partition(",")[0].partition(".")[0] in text, name
    assert "`" not in re.sub("`(kinboard|pip) [^`]+`", "", text.partition("options:")[2]), "names of options"
