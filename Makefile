# `make demo` does the main job on a simulated bench that conceals something, `make test` runs every test, `make prove` shows on draws that
# nobody has seen how well diagnoses name what a recording conceals.
#
# All need Rust, make and a C compiler. What they need besides is installed by apt when it is missing and apt is there. Without OpenCV
# the program is built without depth cameras; without Chromium the tests concerned say that they were skipped.
.PHONY: demo test computing waiting devices rig prove opencv chromium

# A bench that nobody has seen: SEED=… draws one again.
DEMO := target/demo

demo: opencv
	cargo build --release --quiet $(FEATURES)
	@seed="$(SEED)"; [ -n "$$seed" ] || seed=$$(od -An -N4 -tu4 /dev/urandom | tr -d ' '); \
	out=$(DEMO)/$$seed; page=$$out/pages/draw-0001.html; \
	if [ -e $$out ]; then chmod -R u+w $$out && rm -rf $$out $$out.sealed $$out.key; fi; \
	mkdir -p $(DEMO) && target/release/phantom-rig demo --seed $$seed --out $$out && \
	if [ -n "$${DISPLAY:-}$${WAYLAND_DISPLAY:-}" ] && command -v xdg-open >/dev/null; then \
		xdg-open $$page >/dev/null 2>&1 || true; \
	else \
		echo "Open $(CURDIR)/$$page in a browser."; \
	fi

# Takes hours; stopped, it goes on when called again. SEED=… takes a seed of one's own, COUNT=… another number of draws.
COUNT ?= 500
PROOFS := target/proofs

prove: opencv
	cargo build --release --quiet $(FEATURES)
	@mkdir -p $(PROOFS); \
	if [ -n "$(SEED)" ]; then seed="$(SEED)"; \
	elif [ -s $(PROOFS)/seed ]; then seed=$$(cat $(PROOFS)/seed); \
	else seed=$$(od -An -N4 -tu4 /dev/urandom | tr -d ' '); echo "$$seed" > $(PROOFS)/seed; fi; \
	echo "Seed $$seed, $(COUNT) draws in $(PROOFS)/$$seed"; \
	target/release/phantom-rig conceal --seed "$$seed" --count $(COUNT) --out "$(PROOFS)/$$seed" && \
	target/release/phantom-rig prove "$(PROOFS)/$$seed"; code=$$?; \
	if [ $$code = 0 ] || [ $$code = 3 ]; then \
		if [ "$$(cat $(PROOFS)/seed 2>/dev/null)" = "$$seed" ]; then rm $(PROOFS)/seed; fi; \
		exit 0; \
	fi; \
	exit $$code

test: opencv chromium
	cargo fmt --all --check
	cargo clippy --release --workspace --all-targets $(FEATURES) -- -D warnings
	$(TEST) --no-run
	@$(MAKE) --no-print-directory -j2 computing waiting; code=$$?; cat $(WAITED); exit $$code
	RUST_TEST_THREADS=8 $(TEST) --lib -- $(IN_TIME)
	@$(MAKE) --no-print-directory --output-sync -j2 $(ALONE)
	RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps $(FEATURES)

TEST = cargo test --release --workspace $(FEATURES)

# Drivers under test are late where others keep the processors busy: they run beside each other only, and mostly wait.
IN_TIME := driver:: session::
ALONE := devices rig
$(ALONE):
	RUST_TEST_THREADS=8 $(TEST) --test $@

# Tests that wait for pictures and a browser run beside all others, and those give way. What the waiting ones say can be read in a file
# until both are done.
GIVING_WAY := $(shell chrt -i 0 true 2>/dev/null && echo chrt -i 0 || echo nice -n 19)
WAITED := target/waiting.log
WAITING := camera page
COMPUTING := $(filter-out $(ALONE) $(WAITING),$(basename $(notdir $(patsubst %/main.rs,%.rs, \
	$(foreach tests,tests firmware_proto/tests,$(wildcard $(tests)/*.rs $(tests)/*/main.rs))))))

computing:
	RUST_TEST_THREADS=4 $(GIVING_WAY) $(TEST) --lib -- $(IN_TIME:%=--skip %)
	RUST_TEST_THREADS=4 $(GIVING_WAY) $(TEST) --bins $(COMPUTING:%=--test %)
	$(GIVING_WAY) $(TEST) --doc

waiting:
	@echo "Other tests run beside these: see $(WAITED)"
	@RUST_TEST_THREADS=4 $(TEST) $(WAITING:%=--test %) >$(WAITED) 2>&1 || { echo "Some of them failed: see $(WAITED)"; exit 1; }

# Installs Debian's packages in $$1, and says $$2 if that fails.
INSTALL = install() { \
	if [ "$$(id -u)" = 0 ]; then as=; elif command -v sudo >/dev/null; then as="sudo -n"; else as=false; fi; \
	{ $$as apt-get update -qq && DEBIAN_FRONTEND=noninteractive $$as apt-get install -y -qq --no-install-recommends $$1; } \
		>/dev/null || echo "$$2"; \
}

# Captures depth cameras: OpenCV, what GStreamer needs for raw pictures, and clang with its library, which reads OpenCV's headers when
# the bindings are built.
opencv:
	@$(INSTALL); packages="libopencv-videoio-dev gstreamer1.0-plugins-base clang g++"; \
	if command -v apt-get >/dev/null && ! { dpkg -s $$packages && $(BINDABLE); } >/dev/null 2>&1; then \
		install "$$packages" "OpenCV could not be installed: depth cameras are left out"; \
	fi

# Looked at when it is used: after what was missing has been installed.
FEATURES = $(shell $(BINDABLE) || echo --no-default-features)
BINDABLE = { command -v clang && command -v c++ && ls /usr/lib/llvm-*/lib/libclang.so* && \
	{ test -e /usr/include/opencv4/opencv2/videoio.hpp || test -e /usr/local/include/opencv4/opencv2/videoio.hpp; }; } >/dev/null 2>&1

# Opens the page in the tests of the report.
chromium:
	@$(INSTALL); if ! command -v chromium >/dev/null && command -v apt-get >/dev/null; then \
		install chromium "chromium could not be installed: the tests that open the page will be skipped"; \
	fi
