# Two commands on a fresh machine: `make dance` and `make test`. Everything else is for developers.
#
#   make dance    the hip-shake clip, from video to a dancing robot (ARGS="--minutes 5" and others)
#   make test     all tests, one process a core up to four (ARGS="tests/mocap -x"; WORKERS=0 for one process;
#                 ARGS="-m 'not heavy'" for what CI runs)
#   make test-fast  more than four fifths of them, of every folder, within 90 s on two idle cores
#   make test-stack  the whole stack and the documented server as processes, end to end (half an
#                 hour; apt-get install postgresql chromium)
#   make test-browser  pages and live dances in a browser (apt-get install chromium)
#   make bench    accuracy of the mocap stage against ground truth, cost of assessing a clip
#   make bench-mocap  the first of the two alone, writes benchmarks/results/mocap.json and .md
#   make bench-retarget  our solver beside the paper's mapping and mink (pip install -e '.[bench]')
#   make bench-learning  speed beside sb3-contrib and bare MuJoCo, policies evaluated (hours; resumable)
#   make bench-pages  how fast pages and live dances are in chromium (ARGS="PAGE...")
#   make bench-league  the G1's dancers beside each other, and performances (ARGS="--holosoma FOLDER")
#   make bench-orchestration  what Prefect costs around the work (PostgreSQL and a server are started)
#   make badinput  every case of the corpus of bad inputs through the real command, and a table
#   make chaos    20 studies whose processes, services, disk and wires are cut at random moments
#   make deploy   pools, deployments and automations on the server of PREFECT_API_URL
#   make lint     ruff, mypy and the order of imports (docs/architecture.md)
#   make docs     the documentation as a site in build/site; every link is checked
#   make coverage all tests with the share of lines and branches that they run
#   make wheel    the package, checked as the index would, in dist/
#   make doctor   what is installed and what is missing
#   make clean    remove the environment and all caches; the store stays
#
# Each sets up its own environment, .venv, and reuses it. TORCH_INDEX chooses where torch comes from,
# PYTHON the interpreter (3.11, 3.12 or 3.13), ROBOJACKSON_STORE where results are kept.

PY := .venv/bin/python
ARGS ?=
WORKERS ?= auto
# A worker that crashes ends the run, which names its test: groups wait for ever for another one.
PYTEST := $(PY) -m pytest -q -n $(WORKERS) --dist loadgroup --max-worker-restart=0
export OMP_NUM_THREADS ?= 1
# Images of containers often forbid compiled modules: every process would compile 1,000 files again.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: badinput dance test test-fast test-stack test-browser coverage bench bench-league bench-learning bench-mocap bench-retarget chaos bench-orchestration bench-pages deploy lint doctor docs wheel clean setup
.DEFAULT_GOAL := dance

setup:
	@sh tools/bootstrap.sh install

dance: setup
	@.venv/bin/robojackson dance $(ARGS)

test: setup
	@$(PYTEST) $(ARGS)

test-fast: setup
	@$(PYTEST) -m "not slow and not medium" $(ARGS)

coverage: setup
	@$(PYTEST) --cov --cov-report=term $(ARGS)

test-stack: setup
	@$(PY) -m pytest -q -m cluster tests/deploy $(ARGS)

test-browser: setup
	@$(PY) -m pytest -q -m browser tests/browser $(ARGS)

bench-mocap: setup
	@$(PY) -m benchmarks.mocap.accuracy $(ARGS)

bench-retarget: setup
	@$(PY) -m benchmarks.retarget.compare $(ARGS)

bench: setup
	@$(PY) -m benchmarks.mocap.accuracy $(ARGS)
	@$(PY) -m benchmarks.search.assessment_costs

bench-learning: setup
	@$(PY) -m benchmarks.learning.learning_suite $(ARGS)

bench-pages: setup
	@$(PY) -m benchmarks.report.page_speed $(ARGS)

bench-league: setup
	@$(PY) -m benchmarks.learning.tracker_rows --friction 1
	@$(PY) -m benchmarks.learning.performance_rows
	@$(PY) -m benchmarks.learning.league $(ARGS)

bench-orchestration: setup
	@$(PY) -m benchmarks.orchestration.orchestration_suite $(ARGS)

chaos: setup
	@$(PY) -m tests.chaos.run --trials 20 --seed 0 $(ARGS)

badinput: setup
	@$(PY) -m tests.badinput.run $(ARGS)

deploy: setup
	@.venv/bin/robojackson deploy $(ARGS)

lint: setup
	@$(PY) -m ruff check .
	@$(PY) -m ruff format --check .
	@$(PY) -m mypy
	@.venv/bin/lint-imports --no-cache

docs: setup
	@$(PY) -m tools.assets.settings_page
	@$(PY) -m tools.assets.data_contracts_page
	@$(PY) -m zensical build --clean --strict

wheel: setup
	@SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) $(PY) -m build --outdir dist .
	@$(PY) -m twine check --strict dist/*

doctor: setup
	@.venv/bin/robojackson doctor $(ARGS)

clean:
	rm -rf .venv build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -not -path './.git/*' -exec rm -rf {} +
