# Two commands: `make run` opens the sample level, `make test` runs the tests. Both set everything up first.
PYTHON := .venv/bin/python
STAMP  := .venv/.ready
# Tests open real windows; without a display they get a virtual one.
SCREEN := .ci/with-display

.PHONY: run test test-slow check lint types imports format lock setup clean

run: $(STAMP)
	$(PYTHON) main.py

test: $(STAMP)
	$(SCREEN) $(PYTHON) -m pytest

test-slow: $(STAMP)
	$(SCREEN) $(PYTHON) -m pytest -m slow

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
