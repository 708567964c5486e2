# steptwin: every target sets up what it needs by itself. `make help` lists them.

PYTHON ?= python3
ARGS ?=

UV := .tools/bin/uv
BIN := .venv/bin

# The environment belongs to one interpreter; another one (PYTHON=, PYENV_VERSION=) makes it anew.
PYTHON_ID := $(shell $(PYTHON) -c 'import sys; print("%d.%d.%d" % sys.version_info[:3] if sys.version_info >= (3, 11) else "")' 2>/dev/null)
PYTHON_STAMP := .venv/.python-$(PYTHON_ID)
RUN_STAMP := .venv/.ready-run
DEV_STAMP := .venv/.ready-dev
NODE_STAMP := .venv/.ready-node
WEB := $(BIN)/python studio-web/build.py

# The page of the studio, and what it is made of.
PAGE := src/steptwin/studio/page/index.html
PAGE_SOURCES := docs/studio.schema.json $(shell find studio-web -type f -not -path '*/node_modules/*' -not -path '*/__pycache__/*' \
  -not -name types.ts)

# The page with the studio inside it; the last file that is written for it. What Python it has in it is known when it has been built.
SITE := build/site/try/service.js
SITE_SOURCES := $(filter-out %.test.ts, $(PAGE_SOURCES))
-include build/modules.d

# Tools that its tests need beside what it is built with.
WEB_STAMP := .venv/.ready-web

# The extension for VS Code.
EXTENSION := editors/vscode
EXTENSION_STAMP := $(EXTENSION)/node_modules/.steptwin

# Clients of other makers, for tests of the gateways.
CLIENTS := tests/gateways/clients
CLIENTS_STAMP := $(CLIENTS)/node_modules/.steptwin

# uv takes the interpreter it is given and what the lock files name, whatever project or environment surrounds it. Without compiled
# modules every process would compile all that it imports.
export UV_PYTHON_DOWNLOADS := never
unexport VIRTUAL_ENV PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE
INSTALL := $(UV) pip install --quiet --python $(BIN)/python

PEER_PACKAGES := chromium-headless-shell curl mbpoll libmodbus-dev gcc libc6-dev pkg-config make mosquitto mosquitto-clients openssl postgresql \
  prometheus ser2net tshark

.DEFAULT_GOAL := help
.PHONY: help run test lowest golden soak extras page site vsix release lint format types imports bench docs peers lock clean

help:  ## Show the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

run: $(RUN_STAMP)  ## Show a demo machine in the browser (ARGS="MACHINE.toml --speed 0.5 ...": options of steptwin studio)
	@$(MAKE) --silent --no-print-directory page || echo "the page of the studio could not be built; the service runs without it" >&2
	@exec $(BIN)/steptwin studio $(ARGS)

test: $(DEV_STAMP) $(WEB_STAMP) $(PAGE) $(SITE) $(EXTENSION_STAMP) $(CLIENTS_STAMP)  ## Run the tests (ARGS="-k mic_7 ..."); peers that are missing are skipped
	$(BIN)/pytest -n auto --dist worksteal $(ARGS)

# Each bound of pyproject.toml as the version that is installed: one file for each extra, and the import of every module.
LOWEST := build/lowest
LOWEST_TESTS := test_import_weight.py wire/test_rtu.py cli/test_main.py live/test_rfc2217.py files/export/test_vcd.py \
  files/export/test_plot.py files/export/test_tables.py files/scene/test_picture.py lsp/test_stdio.py studio/test_openapi.py \
  gateways/test_prometheus.py gateways/opcua/test_nodetypes.py gateways/mqtt/test_gateway.py gateways/epics/test_channels.py \
  files/test_certificate.py live/test_telemetry.py bluesky history/test_database.py campaign/test_cases.py \
  campaign/test_search.py::test_the_same_cases_for_the_same_results \
  campaign/test_campaign.py::test_a_worker_of_dask_that_is_killed_loses_nothing
lowest: $(PYTHON_STAMP) $(PAGE)  ## Try the lowest versions of libraries that pyproject.toml permits
	@$(UV) venv --quiet --clear --no-project --python $(BIN)/python $(LOWEST)
	@$(UV) pip compile --quiet --resolution lowest-direct --all-extras --python $(LOWEST)/bin/python pyproject.toml -o $(LOWEST)/libraries.txt
	@$(UV) pip install --quiet --python $(LOWEST)/bin/python -r $(LOWEST)/libraries.txt --group build --group test --editable .
	@$(LOWEST)/bin/steptwin doctor
	$(LOWEST)/bin/pytest -n auto --dist worksteal $(addprefix tests/,$(LOWEST_TESTS)) $(ARGS)

golden: $(DEV_STAMP)  ## Make the golden files of tests anew (ARGS=tests/mic488/test_registers_golden.py): read the diff
	@for test in $(ARGS); do PYTHONPATH=tests/support $(BIN)/python $$test || exit 1; done

soak: $(DEV_STAMP)  ## Run the soak tests at full length (STEPTWIN_SOAK=0.1 for a tenth)
	STEPTWIN_SOAK=$${STEPTWIN_SOAK:-1} $(BIN)/pytest -n auto -m soak tests/soak $(ARGS)

page: $(PAGE)  ## Build the page of the studio

vsix: $(EXTENSION_STAMP)  ## Build the extension for VS Code: build/steptwin.vsix
	@$(WEB) vsix $(EXTENSION)

extras: $(DEV_STAMP)  ## Install what pictures, other exports, campaigns and the editor server need (as the tests do)

lint: $(DEV_STAMP) $(NODE_STAMP)  ## Check style and formatting
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@$(WEB) lint
	@$(WEB) lint $(EXTENSION)

format: $(DEV_STAMP) $(NODE_STAMP)  ## Repair style and formatting
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	@$(WEB) format
	@$(WEB) format $(EXTENSION)

types: $(DEV_STAMP) $(NODE_STAMP)  ## Check the types
	$(BIN)/pyrefly check
	@$(WEB) types
	@$(WEB) types $(EXTENSION)

imports: $(DEV_STAMP)  ## Check that imports go down only and that pure packages are pure
	$(BIN)/lint-imports --no-logo

bench: $(DEV_STAMP)  ## Measure requests per second and latencies against other servers
	$(BIN)/python -m bench $(ARGS)

# Versions that agree, nothing that is not committed; the wheel is tried before its checksum is written.
RELEASE := build/release
BOM := $(RELEASE)/steptwin-$$v
release: $(DEV_STAMP)  ## Build wheel, source archive, extension, site, lists of components, checksums: build/release
	@$(BIN)/python .ci/release.py check
	@$(MAKE) --no-print-directory page vsix site
	@rm -rf $(RELEASE) && mkdir -p $(RELEASE)
	@$(BIN)/python -m hatchling build -t sdist -t wheel -d $(RELEASE) >/dev/null
	@.tools/bin/pip install -qq --disable-pip-version-check --require-hashes -r requirements/release.txt
	@v=$$($(BIN)/python -c 'import steptwin; print(steptwin.__version__)') \
	&& cp build/steptwin.vsix $(RELEASE)/steptwin-$$v.vsix \
	&& tar -czf $(RELEASE)/steptwin-$$v-site.tar.gz -C build site \
	&& .tools/bin/cyclonedx-py requirements requirements/run.txt --pyproject pyproject.toml --output-reproducible -o $(BOM)-python.cdx.json \
	&& $(WEB) sbom > $(BOM)-page.cdx.json
	@$(BIN)/python .ci/release.py finish $(RELEASE)

docs: $(DEV_STAMP)  ## Build the documentation into build/docs
	$(BIN)/sphinx-build -W --keep-going --quiet -b html -d build/doctrees docs build/docs
	@echo "build/docs/index.html"

site: $(DEV_STAMP) $(SITE)  ## Build a folder for any web server: the documentation, and try/, a studio with its twin inside the page
	$(BIN)/sphinx-build -W --keep-going --quiet -b html -D studio_links=1 -d build/doctrees docs build/site-docs
	@find build/site -mindepth 1 -maxdepth 1 -not -name try -exec rm -rf {} + && cp -r build/site-docs/. build/site/
	@echo "build/site: $(PYTHON) -m http.server --bind 127.0.0.1 -d build/site, then http://127.0.0.1:8000/try/"

peers:  ## Install the system packages the tests talk to (Debian)
	@missing=""; \
	for package in $(PEER_PACKAGES); do \
	  dpkg -s $$package 2>/dev/null | grep -q '^Status: install ok installed' || missing="$$missing $$package"; \
	done; \
	if [ -z "$$missing" ]; then echo "peers: all installed"; exit 0; fi; \
	echo "peers: installing$$missing"; \
	if [ "$$(id -u)" -eq 0 ]; then sudo=""; else sudo="sudo"; fi; \
	apt="$$sudo env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=120"; \
	$$apt install -y --no-install-recommends $$missing </dev/null \
	|| { $$apt update </dev/null && $$apt install -y --no-install-recommends $$missing </dev/null; }

lock: $(UV)  ## Pin the dependencies anew (ARGS="--upgrade" takes newer ones)
	$(COMPILE) requirements/tools.in -o requirements/tools.txt
	$(COMPILE) requirements/node.in -o requirements/node.txt
	$(COMPILE) requirements/release.in -o requirements/release.txt
	$(COMPILE) pyproject.toml --extra lsp --extra studio --group build -o requirements/run.txt
	$(COMPILE) pyproject.toml --all-extras --group build --group dev -c requirements/run.txt -o requirements/dev.txt

COMPILE := env -u UV_FIND_LINKS -u PIP_FIND_LINKS UV_CUSTOM_COMPILE_COMMAND="make lock" \
  $(UV) pip compile --quiet --universal --python-version 3.11 --fork-strategy fewest --generate-hashes --no-annotate $(ARGS)

clean:  ## Remove everything that was built, downloaded or cached here
	rm -rf .venv .tools build dist studio-web/node_modules $(EXTENSION)/node_modules $(EXTENSION)/dist $(CLIENTS)/node_modules src/steptwin/studio/page src/steptwin/files/export/page/scene.js studio-web/src/lib/protocol/types.ts .pytest_cache .hypothesis .ruff_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

NEED_PYTHON := [ -n "$(PYTHON_ID)" ] || { \
  echo "steptwin needs Python 3.11 or newer, '$(PYTHON)' is not. Name one: make PYTHON=python3.12 ..." >&2; exit 1; }
NEED_VENV := $(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
  echo "'$(PYTHON)' cannot make environments. On Debian: apt-get install python3-venv" >&2; exit 1; }

$(UV): requirements/tools.txt
	@$(NEED_PYTHON)
	@$(NEED_VENV)
	@echo "setting up .tools"
	@$(PYTHON) -m venv --clear .tools
	@.tools/bin/pip install -qq --disable-pip-version-check --require-hashes -r requirements/tools.txt
	@touch $@

$(PYTHON_STAMP): | $(UV)
	@$(NEED_PYTHON)
	@echo "setting up .venv for Python $(PYTHON_ID)"
	@$(UV) venv --quiet --clear --no-project --python "$$($(PYTHON) -c 'import sys; print(sys.executable)')" .venv
	@touch $@

$(RUN_STAMP): $(PYTHON_STAMP) requirements/run.txt pyproject.toml
	@echo "installing steptwin"
	@$(INSTALL) --require-hashes -r requirements/run.txt
	@$(INSTALL) --no-build-isolation --no-deps --editable .
	@touch $@

# The machine's node where it is new enough; otherwise one from a wheel.
$(NODE_STAMP): $(PYTHON_STAMP) requirements/node.txt
	@$(WEB) node || { echo "installing node"; $(INSTALL) --require-hashes -r requirements/node.txt; }
	@touch $@

# In an unpacked source archive the page is there already, and node is not needed.
$(PAGE): $(PAGE_SOURCES)
	@$(MAKE) --no-print-directory $(NODE_STAMP)
	@echo "building the page of the studio"
	@$(WEB) build
	@touch $@

$(SITE): $(SITE_SOURCES) | $(DEV_STAMP) $(WEB_STAMP) $(PAGE)
	@echo "building the studio inside a page"
	@$(WEB) site

$(WEB_STAMP): $(NODE_STAMP) studio-web/package-lock.json
	@echo "installing what the tests of the page need"
	@$(WEB) install
	@touch $@

$(EXTENSION_STAMP): $(NODE_STAMP) $(EXTENSION)/package-lock.json
	@echo "installing what the extension for VS Code needs"
	@$(WEB) install $(EXTENSION)
	@touch $@

$(CLIENTS_STAMP): $(NODE_STAMP) $(CLIENTS)/package-lock.json
	@echo "installing clients that the gateways are tested with"
	@$(WEB) install $(CLIENTS)
	@touch $@

$(DEV_STAMP): $(RUN_STAMP) requirements/dev.txt
	@echo "installing what tests, checks and documentation need"
	@$(INSTALL) --require-hashes -r requirements/dev.txt
	@touch $@
