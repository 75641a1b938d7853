# SPDX-License-Identifier: BSD-3-Clause
"""What the tables of machines are asked for."""
import argparse
import secrets
import sys
from pathlib import Path

import builds
import confusion_table


def parser_of(description, command):
    """What a table of machines is asked for, whose machines another command looks at."""
    parser = argparse.ArgumentParser(description=description)
    for tool in (command, "make_machine"):
        parser.add_argument("--" + tool.split("_", maxsplit=1)[0],
                            help=f"path of {tool} (default: PATH, then the workspace)")
    parser.add_argument("--seed", type=int, help="of the first machine (default: drawn, and printed)")
    parser.add_argument("--build", choices=builds.BUILDS, default="servo", help="of the servos (default: %(default)s)")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="each N-th machine only")
    parser.add_argument("--jobs", type=int, default=2, help="at the same time (default: %(default)s)")
    parser.add_argument("--keep", metavar="DIR", required=True, help="work here, machines that are there are kept")
    return parser


def arguments_of(parser, command):
    """The arguments, complete: seed, executables, folder and rig file of the build. Ends with 66 without executables."""
    args = parser.parse_args()
    if args.seed is None:
        args.seed = secrets.randbelow(2**31)
        print(f"--seed {args.seed}", flush=True)
    for tool in (command, "make_machine"):
        name = tool.split("_", maxsplit=1)[0]
        path = confusion_table.find(tool, getattr(args, name))
        if path is None:
            print(f"{parser.prog}: --{name}: executable not found", file=sys.stderr)
            sys.exit(66)
        setattr(args, name, path)
    args.folder = Path(args.keep).resolve()
    args.folder.mkdir(parents=True, exist_ok=True)
    servo = confusion_table.REPOSITORY / confusion_table.RIGS["servo"]
    args.rig = builds.declared(builds.BUILDS[args.build], servo, args.folder)
    return args
