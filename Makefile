# Two commands: `make run` opens the sample level, `make test` runs the tests. Both set everything up first.
PYTHON := .venv/bin/python
STAMP  := .venv/.ready
# Tests open real windows; without a display they get a virtual one.
SCREEN := .ci/with-display

.PHONY: run test test-slow gpu check lint types imports format lock setup clean

run: $(STAMP)
	$(PYTHON) main.py

test: $(STAMP)
	$(SCREEN) $(PYTHON) -m pytest

test-slow: $(STAMP)
	$(SCREEN) $(PYTHON) -m pytest -m slow

# Everything that waits for a CUDA card: parity, speed by stage and scale, the choice of BVH, two published workloads.
# NumPy, SciPy and Warp are enough; with pytest and hypothesis the tests marked cuda run too: make gpu PYTHON=python3
gpu:
	mkdir -p build/gpu
	if $(PYTHON) -c "import pytest, hypothesis" 2>/dev/null; then \
		$(PYTHON) -m pytest -m cuda -W "ignore::pytest.PytestConfigWarning" tests/trace; \
	else echo "no pytest here: parity is the first table of the benchmark"; fi
	$(PYTHON) main.py bench speed --device cuda --largest 10000000 --json | tee build/gpu/speed.jsonl
	$(PYTHON) main.py bench workloads --device cuda --json | tee build/gpu/workloads.jsonl

check: lint types imports test

lint: $(STAMP)
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .

types: $(STAMP)
	.venv/bin/pyright

imports: $(STAMP)
	.venv/bin/lint-imports

format: $(STAMP)
	$(PYTHON) -m ruff check --fix .
	$(PYTHON) -m ruff format .

setup: $(STAMP)

$(STAMP): requirements.lock .ci/setup
	.ci/setup
	touch $@

# After a change of the dependencies in pyproject.toml.
lock: $(STAMP)
	.venv/bin/uv pip compile pyproject.toml --extra dev --python-version 3.11 --universal \
		--generate-hashes --no-header --no-emit-index-url -q -o requirements.lock

clean:
	rm -rf .venv .pytest_cache .ruff_cache .hypothesis build results
