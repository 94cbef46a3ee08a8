# AirTouch. `make demo` and `make test` do all the set-up they need.
PYTHON ?= python3
BIN := .venv/bin
SOURCES := $(wildcard firmware/kernels/*.[ch] firmware/link/*.[ch] firmware/app/core/*.[ch] \
  firmware/app/src/*.[ch] gap8/kernels/*.[ch] gap8/app/src/*.[ch] gap8/model/*.[ch] \
  host/airtouch/kernels/batch/*.[ch])
#: C that needs neither the firmware's headers nor the GAP8's SDK
FLIES = $(wildcard firmware/kernels/*.c firmware/link/*.c firmware/app/core/*.c gap8/kernels/*.c) \
  gap8/app/src/gap8_core.c
FLIES_INCLUDES = -Ifirmware/kernels -Ifirmware/link -Ifirmware/app/core -Igap8/kernels -Igap8/model -Igap8/app/src

unexport PYTHONDONTWRITEBYTECODE  # packages are installed without: what was compiled once is kept

.PHONY: help setup demo test lint tidy docs fuzz fuzz-logs mutate repeat bench firmware emulate gap8 flash clean

help:  ## this list
	@grep -E '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: .venv/.kernels  ## make .venv with everything in it

.venv/.packages: pyproject.toml tools/constraints.txt tools/setup.sh
	PYTHON=$(PYTHON) sh tools/setup.sh
	@touch $@

.venv/.kernels: .venv/.packages $(SOURCES)
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@echo "Compiling what is not compiled yet of the simulator"
	@$(BIN)/python -c "import keras, matplotlib.pyplot, sklearn.ensemble" 2> /dev/null & \
	  $(BIN)/python -c "from airtouch.simulation import compiled; compiled.compile_all()" && wait
	@touch $@

demo: setup  ## the main job: train, prune, export, detect through the C kernels, report
	$(BIN)/airtouch demo --force

test: setup  ## every test, sanitizers included
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder $(PYTEST_ARGS)

lint: setup  ## ruff over Python and notebooks, mypy over types, clang-format over C (pyproject.toml, .clang-format); FIX=1 mends what it can
	$(BIN)/ruff check $(if $(FIX),--fix) .
	$(BIN)/python -m mypy
	$(BIN)/clang-format $(if $(FIX),-i,--dry-run --Werror) $$(git ls-files '*.c' '*.h')

tidy: setup  ## clang-tidy over the C that flies, by .clang-tidy; fetches clang-tidy (38 MB) the first time
	@[ -x $(BIN)/clang-tidy ] || $(BIN)/python -m pip install --quiet -c tools/constraints.txt clang-tidy
	$(BIN)/clang-tidy --quiet $(FLIES) -- -std=c11 $(FLIES_INCLUDES)

docs:  ## build the site of host/docs, strictly: build/site
	$(PYTHON) -m venv build/docs-env
	build/docs-env/bin/python -m pip install --quiet -c tools/docs-constraints.txt mkdocs-material
	build/docs-env/bin/mkdocs build --strict -f host/mkdocs.yml -d $(CURDIR)/build/site

fuzz:  ## fuzz the C that flies for long: [TARGET="parser app"] [RUNS=1000000] [RESUME=1]
	$(PYTHON) tools/fuzz.py $(TARGET) $(if $(RUNS),--runs $(RUNS)) $(if $(RESUME),--resume)

fuzz-logs: setup  ## fuzz the log readers: [RUNS=100000] [ARGS="--format usd-2 --first 100000"]
	$(BIN)/python tools/fuzz_logs.py --count $(or $(RUNS),100000) $(ARGS)

mutate: setup  ## changes that no test notices, in references, selection and score: [GROUP=score] [SAMPLE=60] [ARGS=--show]
	@$(BIN)/python -c "import mutmut" 2> /dev/null || $(BIN)/python -m pip install --quiet -c tools/constraints.txt mutmut
	$(BIN)/python tools/mutate.py $(GROUP) $(if $(SAMPLE),--sample $(SAMPLE)) $(ARGS)

repeat: setup  ## the tests that use threads, sockets or processes, many times over: [TIMES=50] [TEST=tests/sitl]
	$(BIN)/python tools/repeat.py $(TEST) --times $(or $(TIMES),50)

bench: setup  ## time the kernels and the simulator against their peers, as ratios
	$(BIN)/python tools/bench.py $(BENCH_ARGS)
	$(BIN)/python tools/bench_simulation.py

firmware:  ## build the STM32 app: CRAZYFLIE_BASE=... [PLATFORM=cf21bl] [VEHICLE=...] [CONFIG=app-config-tap]
	@sh firmware/app/build.sh "$(CRAZYFLIE_BASE)" "$(or $(CONFIG),app-config)" "$(or $(PLATFORM),cf2)" "$(VEHICLE)" \
	  "$(NETWORKS)"

emulate: setup  ## the whole firmware with the app in QEMU: CRAZYFLIE_BASE=... [ARGS="flight.csv --steps 2400"]
	@$(BIN)/python -m tools.firmware_emulation "$(CRAZYFLIE_BASE)" $(ARGS)

gap8:  ## build the GAP8 app: GAP_SDK_HOME=... AIDECK=...
	@sh gap8/app/build.sh "$(GAP_SDK_HOME)" "$(AIDECK)"

flash: setup  ## check and flash the image last built, or that of [PLATFORM=...] [CONFIG=...], or [IMAGE=...]: [URI=...] [CHECK=1]
	@image="$(or $(IMAGE),$(if $(PLATFORM)$(CONFIG),build/firmware/$(or $(PLATFORM),cf2)$(CONFIG:app-config%=%).bin))"; \
	image=$${image:-$$(cat build/firmware/image 2> /dev/null)}; \
	[ -n "$$image" ] || { echo "make flash: no image: make firmware CRAZYFLIE_BASE=..., or give IMAGE=..." >&2; exit 1; }; \
	$(BIN)/airtouch flash "$$image" $(if $(URI),--uri "$(URI)") $(if $(CHECK),--check)

clean:  ## remove what was built
	rm -rf .venv build out host/*.egg-info host/airtouch/kernels/*.so
