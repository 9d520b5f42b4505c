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

# Everything that waits for a CUDA card, what matters most first. Each step is a command of its own that ends within ten
# minutes; one that fails stops none. NumPy, SciPy and Warp are enough; with pytest and hypothesis the tests marked cuda
# run too: make gpu PYTHON=python3. Without a card: make gpu GPU_OPTIONS="--device cpu --share 0.001" GPU_LARGEST=10000
GPU_STEPS   := gpu-card gpu-workloads gpu-tests gpu-scale gpu-largest gpu-overhead
.PHONY: $(GPU_STEPS)
GPU_OPTIONS ?= --device cuda
GPU_LARGEST ?= 10000000
GPU_SCALE   ?= 1000000
GPU_BENCH    = mkdir -p build/gpu; timeout 570 $(PYTHON) main.py bench $(1) $(GPU_OPTIONS) --json \
		> build/gpu/$(2).jsonl; status=$$?; cat build/gpu/$(2).jsonl; exit $$status

gpu:
	@failed=""; for step in $(GPU_STEPS); do \
		echo "== $$step"; $(MAKE) --no-print-directory $$step || failed="$$failed $$step"; \
	done; if [ -n "$$failed" ]; then echo "gates or steps that failed:$$failed"; exit 1; fi

# Parity with brute force and Embree; BVH constructor x leaf x block at 1.8 M triangles, and the card's own limits.
gpu-card:
	@$(call GPU_BENCH,speed --tables parity$(,)card,card)

# The levels of Sloan et al. 2013 and of NVIDIA's baking sample with all their rays, stage by stage.
gpu-workloads:
	@$(call GPU_BENCH,workloads,workloads)

gpu-tests:
	@if $(PYTHON) -c "import pytest, hypothesis" 2>/dev/null; then \
		timeout 570 $(PYTHON) -m pytest -q -m cuda -W "ignore::pytest.PytestConfigWarning" tests/trace tests/decorators tests/solve; \
	else echo "no pytest here: parity is the first table of gpu-card"; fi

gpu-scale:
	@$(call GPU_BENCH,speed --tables scale$(,)start --largest $(GPU_SCALE),scale)

gpu-largest:
	@$(call GPU_BENCH,speed --tables largest --largest $(GPU_LARGEST),largest)

gpu-overhead:
	@$(call GPU_BENCH,speed --tables overhead$(,)solving,overhead)

, := ,

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
