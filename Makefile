PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
READY := .venv/ready

.PHONY: install extras demo test fuzz recovery bench lint clean

install: $(READY)

$(READY): pyproject.toml constraints.txt
	@echo "installing into .venv; the first time this downloads some 500 MB"
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt setuptools wheel
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt --no-build-isolation -e '.[dev]'
	@touch $@

# What is optional: Gymnasium, trained policies, other robots, 3-D in a browser.
extras: install
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt --no-build-isolation -e '.[dev,gym,onnx,robots,view]'

demo: install
	$(BIN)/okiagari run three_pushes --world pendulum --out out/demo/pendulum --overwrite
	$(BIN)/okiagari run three_pushes --world humanoid --out out/demo/humanoid --overwrite

# Two processes, or JOBS=4; whole files each, for their fixtures take long to make. Thread pools would get in their way.
test: install
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n $(or $(JOBS),2) --dist loadfile

# Ten thousand mutated scenarios, suites, robots and command lines: none may do harm.
fuzz: install
	$(BIN)/python -m tests.fuzz --seed $(or $(SEED),0) --count 10000

# The smoke suite against the committed baseline: did recovery get worse?
recovery: install
	rm -rf out/sweep-smoke
	$(BIN)/okiagari sweep smoke --out out/sweep-smoke
	$(BIN)/okiagari check out/sweep-smoke --baseline baselines/smoke.json

bench: install
	$(BIN)/python -m tests.benchmarks

lint: install
	$(BIN)/ruff check
	$(BIN)/mypy

clean:
	rm -rf .venv build out *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
