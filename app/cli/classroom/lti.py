"""``kinboard lti``: what the administrator of a learning platform must enter, and our key."""

from __future__ import annotations

import sys
import tomllib
from argparse import Namespace
from pathlib import Path

EXAMPLE = """\
[[platform]]
name = "Moodle of the school"
issuer = "https://moodle.school.example"
client_id = "…"                  # the platform shows it after the registration
deployments = ["1"]
login_url = "https://moodle.school.example/mod/lti/auth.php"
token_url = "https://moodle.school.example/mod/lti/token.php"
keys_url = "https://moodle.school.example/mod/lti/certs.php"
"""


def run(arguments: Namespace) -> int:
    """Print the addresses; 2 if the file or the extra is missing or the file is invalid."""
    try:
        from app.classroom.lti.platforms import PlatformFileError, key_file, load_platforms, make_key
    except ModuleNotFoundError:
        print("kinboard: LTI needs an extra: pip install 'kinboard[lti]'", file=sys.stderr)
        return 2
    root = arguments.url.rstrip("/")
    print("Enter on the platform (LTI 1.3, an external tool):\n")
    for name, value in (
        ("Tool URL", f"{root}/lti/launch"),
        ("Initiate login URL", f"{root}/lti/login"),
        ("Redirection URI", f"{root}/lti/launch"),
        ("Public keyset URL", f"{root}/lti/keys"),
        ("Content selection URL", f"{root}/lti/launch"),
        ("Services", "grades: score (AGS); no names and roles"),
        ("Privacy", "first names only, or none; no e-mail"),
    ):
        print(f"  {name:<22} {value}")
    if arguments.file is None:
        print(f"\nThen write a file and set KINBOARD_LTI to its path:\n\n{EXAMPLE}")
        return 0
    path = Path(arguments.file)
    try:
        key = key_file(path, tomllib.loads(path.read_text("utf-8")))
        if make_key(key):
            print(f"\nA private key was written to {key}. Keep it secret.")
        platforms = load_platforms(path)
    except (PlatformFileError, OSError, ValueError) as error:
        print(f"kinboard: {error}", file=sys.stderr)
        return 2
    print(f"\nRegistered in {path}:\n")
    for platform in platforms.all:
        print(
            f"  {platform.name}: {platform.issuer}, client id {platform.client_id}, "
            f"deployments {', '.join(platform.deployments)}"
        )
    return 0
