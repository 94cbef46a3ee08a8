#!/bin/sh
# Makes .venv with every pinned package. Called by `make setup`.
set -eu
python=${PYTHON:-python3}
"$python" - <<'PY' || exit 1
import sys
if not (3, 11) <= sys.version_info[:2] <= (3, 13):
    sys.exit("AirTouch needs Python 3.11, 3.12 or 3.13 (TensorFlow has no newer wheel); "
             f"this is {sys.version.split()[0]}. Try: make setup PYTHON=python3.12")
PY
if ! "$python" -m venv .venv 2>/dev/null; then
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update -qq && apt-get install -y -qq python3-venv >/dev/null
        "$python" -m venv .venv
    else
        echo "python3 cannot make a virtual environment: apt-get install python3-venv, then again" >&2
        exit 1
    fi
fi
# --no-compile: of 17,000 modules some 4,000 are ever used; Python compiles these when they are first imported
echo "Installing pinned packages into .venv (about 2 GB, a minute or two); pip says what it fetches..."
.venv/bin/python -m pip install --no-compile --quiet --disable-pip-version-check -c tools/constraints.txt "setuptools>=80,<83" wheel numpy scipy numba click
# a minute of one processor, while the other fetches the rest; what fails here is tried again by `make setup`, and told
PYTHONPATH=host .venv/bin/python -c "from airtouch.simulation import compiled; compiled.compile_all()" > /dev/null 2>&1 &
compiling=$!
.venv/bin/python -m pip install --no-compile --progress-bar on --disable-pip-version-check -c tools/constraints.txt --no-build-isolation --editable ".[plots,parquet,pandas,ulog,ros,train,dataset,map,vision,test,bench,scale,fly,flash]"
wait "$compiling" || true
