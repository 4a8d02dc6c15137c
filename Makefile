# Two commands: `make demo` does the main job, `make test` runs every test.
.PHONY: demo test

test:
	cargo fmt --all --check
	cargo clippy --release --workspace --all-targets -- -D warnings
	cargo test --release --workspace
	RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps

demo:
	cargo build --release
