# Two commands: `make demo` does the main job on the bundled recording, `make test` runs every test.
#
# Both need Rust, make and a C compiler. What the tests need besides is installed by apt when it is missing and
# apt is there; without it the tests concerned say that they were skipped.
.PHONY: demo test packages

DEMO := target/demo

demo:
	cargo build --release --quiet
	target/release/phantom-rig fit rigs/demo --out $(DEMO)
	@echo "The recording conceals: rigs/demo.truth.toml"
	@if [ -n "$${DISPLAY:-}$${WAYLAND_DISPLAY:-}" ] && command -v xdg-open >/dev/null; then \
		xdg-open $(DEMO)/fit.html >/dev/null 2>&1 || true; \
	else \
		echo "Open $(CURDIR)/$(DEMO)/fit.html in a browser."; \
	fi

test: packages
	cargo fmt --all --check
	cargo clippy --release --workspace --all-targets -- -D warnings
	cargo test --release --workspace
	RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps

# Chromium opens the page in the tests of the report.
packages:
	@if ! command -v chromium >/dev/null && command -v apt-get >/dev/null; then \
		if [ "$$(id -u)" = 0 ]; then as=; elif command -v sudo >/dev/null; then as="sudo -n"; else as=false; fi; \
		{ $$as apt-get update -qq && $$as apt-get install -y -qq --no-install-recommends chromium; } >/dev/null \
			|| echo "chromium could not be installed: the tests that open the page will be skipped"; \
	fi
