"""Every script and every module of tools that is run starts, and says what it does and what each option
means, and each argument of argparse. Arguments of click have no help texts."""

import subprocess
import sys
from pathlib import Path

TOOLS = Path(__file__).parents[2] / "tools"
RUN_AS = '__name__ == "__main__"'  #: in each file that is run
#: files that are run by their path, and names of modules that are run with `python -m`
SCRIPTS = sorted(map(str, (p for p in TOOLS.rglob("*.py") if RUN_AS in p.read_text("utf-8")
                           and not (p.parent / "__init__.py").exists())))
MODULES = sorted(".".join(p.relative_to(TOOLS.parent).with_suffix("").parts).removesuffix(".__main__")
                 for p in TOOLS.rglob("*.py") if RUN_AS in p.read_text("utf-8") and (p.parent / "__init__.py").exists())
#: runs scripts one after another in one process, as each of them imports much of the same
RUN = """
import argparse, click, io, runpy, sys
from contextlib import redirect_stdout
from pathlib import Path
bare = []
def noting(text, parameters):
    def text_of(self, *rest):
        bare.extend(p.opts[-1] if hasattr(p, "opts") else (p.option_strings or [p.dest])[-1]
                    for p in getattr(self, parameters) if not isinstance(p, click.Argument) and not p.help)
        return text(self, *rest)
    return text_of
argparse.ArgumentParser.format_help = noting(argparse.ArgumentParser.format_help, "_actions")
click.Command.get_help = noting(click.Command.get_help, "params")
for path in sys.argv[1:]:
    bare.clear()
    sys.argv, here, said = [path, "--help"], list(sys.path), io.StringIO()
    sys.path[0] = str(Path(path).parent) if path.endswith(".py") else ""  # as Python does
    try:
        with redirect_stdout(said):
            (runpy.run_path if path.endswith(".py") else runpy.run_module)(path, run_name="__main__")
    except SystemExit as stop:
        fine = stop.code in (0, None) and said.getvalue().lower().startswith("usage:")
        print(path, " ".join(["no help for", *bare]) if bare else 0 if fine else 1)
    except Exception as error:
        print(path, repr(error))
    sys.path[:] = here
"""


def test_every_script_every_option_and_every_argument_of_argparse_has_a_help_text():
    run = subprocess.run([sys.executable, "-c", RUN, *SCRIPTS, *MODULES], capture_output=True, text=True,
                         cwd=TOOLS.parent)
    answers = dict(line.split(" ", 1) for line in run.stdout.splitlines())
    assert len(SCRIPTS) > 30 and len(MODULES) > 3 and set(answers) == {*SCRIPTS, *MODULES}, run.stderr[-1000:]
    assert {path: answer for path, answer in answers.items() if answer != "0"} == {}
