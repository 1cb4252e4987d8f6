# SPDX-License-Identifier: GPL-3.0-or-later
# make demo        the main job, from an empty checkout to pictures in out/demo/
# make test        the tests, on all cores; PYTEST_ARGS="-n 0 -x tests/ui" for some, in one process
# make lint        style, types and who may import whom
# make extension   dist/relume-*.zip, to be installed in Blender
# make bench-placement   time and memory of camera placement; BENCH_ARGS="A.blend --runs 1"
# make bench-placement-quality SCENES="A.blend B.blend"   what cameras see, beside baselines
# make bench-relight   a light edit beside Cycles and EEVEE, and what lights and triangles cost
# make bench-corrmap   a camera move beside EEVEE and Cycles, by cameras and triangles; BENCH_ARGS=--quick
# make bench-indirect BENCH_ARGS="A.blend --cache DIR"   shading samples shared by pixels, beside none
# make bench-instances   what keeping a repeated mesh once on the GPU saves, and what it costs
# make accuracy    every kind of light on every lobe beside Cycles: docs/accuracy.md (an hour or two),
#                  and make scene-accuracy
# make scene-accuracy SCENES="A.blend B.blend"   whole scenes beside Cycles, in views that placement
#                  did not know: docs/scenes_accuracy.md; SCENE_ARGS="--plan" says how long it takes
# make bench-caching BENCH_ARGS="A.blend B.blend"   sizes of caches, what they cost, and bake times
# make bench-flight SCENES="A.blend B.blend"   a camera flight: holes, seams and flicker of each frame
# make write-back  lights' controls in Relume and written back to Cycles: out/write_back/
#
# Each brings what it needs into the checkout first: uv into .uv/ and the rest into .venv/.

SHELL := /bin/bash
PYTHON3 ?= python3
READY := .venv/.relume-ready
RUN := .venv/bin/python
# A file's tests stay together, since they share what a bake left; files go in their own order,
# long ones first. A test that takes Blender down with it is tried again in a new process.
WORKERS := --numprocesses auto --maxprocesses 8 --dist loadfile --no-loadscope-reorder \
	--max-worker-restart 2

.PHONY: accuracy scene-accuracy demo test lint extension bench-placement bench-placement-quality \
	bench-caching bench-corrmap bench-flight bench-indirect bench-instances bench-relight write-back machine clean

demo: $(READY) machine
	$(RUN) -m tools.demo --out out/demo

test: $(READY) machine
	$(RUN) -m pytest $(WORKERS) $(PYTEST_ARGS)

lint: $(READY)
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	$(RUN) -m mypy
	.venv/bin/lint-imports

extension: $(READY)
	$(RUN) -m tools.build_extension

bench-placement: $(READY)
	$(RUN) -m benchmarks.placement $(BENCH_ARGS)

bench-placement-quality: $(READY)
	$(RUN) -m tools.placement_table $(SCENES)
	$(RUN) -m tools.placement_table --ablations $(SCENES)

bench-caching: $(READY) machine
	$(RUN) -m benchmarks.caching $(BENCH_ARGS)

bench-relight: $(READY) machine
	$(RUN) -m benchmarks.relight $(BENCH_ARGS)

bench-flight: $(READY) machine
	$(RUN) -m benchmarks.flight $(SCENES) $(BENCH_ARGS)

bench-corrmap: $(READY) machine
	$(RUN) -m benchmarks.corrmap $(BENCH_ARGS)

bench-instances: $(READY) machine
	$(RUN) -m benchmarks.instances $(BENCH_ARGS)

bench-indirect: $(READY) machine
	$(RUN) -m benchmarks.indirect $(BENCH_ARGS)

write-back: $(READY) machine
	$(RUN) -m benchmarks.write_back $(BENCH_ARGS)

accuracy: $(READY) machine
	$(RUN) -m benchmarks.accuracy $(BENCH_ARGS)
	$(RUN) -m benchmarks.scene_accuracy $(SCENES) $(SCENE_ARGS)

scene-accuracy: $(READY) machine
	$(RUN) -m benchmarks.scene_accuracy $(SCENES) $(SCENE_ARGS)

machine: $(READY)
	@$(RUN) -m tools.check_machine

$(READY): pyproject.toml uv.lock .python-version
	uv="$$($(PYTHON3) tools/get_uv.py)" && "$$uv" sync --locked
	@touch $@

clean:
	rm -rf .venv .uv out dist .ruff_cache .mypy_cache .pytest_cache .hypothesis .import_linter_cache
