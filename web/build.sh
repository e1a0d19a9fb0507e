#!/usr/bin/env bash
# Builds the browser app: the library for WebAssembly, and the page around it, hosted and as one file. What it takes is in README.md.
#
# The installed Rust toolchain may have no standard library for wasm32: Debian's rustc-web has its source, and cargo builds it. With
# `WASM_CARGO` and `WASM_RUSTC` other compilers can be named; nothing of this leaks into native builds.
set -euo pipefail
cd "$(dirname "$0")"

tools=${GLASSWARP_WEB_TOOLS:-$PWD/../target/web-tools}
export CARGO_TARGET_DIR=${GLASSWARP_WASM_TARGET:-$PWD/../target/wasm}
wasm=$CARGO_TARGET_DIR/wasm32-unknown-unknown/release/glasswarp_web.wasm

# wasm-bindgen's program must be of the version of its library.
version=$(sed -n '/^name = "wasm-bindgen"$/{n;s/version = "\(.*\)"/\1/p}' wasm/Cargo.lock)
if [ "$("$tools/bin/wasm-bindgen" --version 2>/dev/null)" != "wasm-bindgen $version" ]; then
    CARGO_TARGET_DIR=$tools-build cargo install --quiet --locked wasm-bindgen-cli --version "$version" --root "$tools" --bin wasm-bindgen
fi
[ -d node_modules/vite ] || npm ci --silent --no-audit --no-fund

# What is inlined where everything is linked is limited: a tenth smaller, and no slower.
small=(-Cllvm-args=-inline-threshold=25)
(
    cd wasm
    export RUSTFLAGS='-C target-feature=+simd128'
    rustc=${WASM_RUSTC:-$(dpkg -L rustc-web 2>/dev/null | grep -m1 'bin/rustc$' || true)}
    cargo=${WASM_CARGO:-$(dpkg -L cargo-web 2>/dev/null | grep -m1 'bin/cargo$' || true)}
    if [ -n "$rustc" ] && [ -n "$cargo" ]; then
        linker=$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/^host: //p')/bin/rust-lld
        # A panic ends the worker whatever it says, and its texts and places are a tenth of the module.
        RUSTFLAGS+=' -Zunstable-options -Cpanic=immediate-abort -Zlocation-detail=none' \
            RUSTC_BOOTSTRAP=1 RUSTC=$rustc CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=$linker \
            "$cargo" rustc --locked --lib --release -Zbuild-std=std,panic_abort --target wasm32-unknown-unknown -- "${small[@]}"
    else
        cargo rustc --locked --lib --release --target wasm32-unknown-unknown -- "${small[@]}"
    fi
)
"$tools/bin/wasm-bindgen" --target web --out-dir wasm/pkg "$wasm"
npx wasm-opt -Oz --strip-debug --strip-producers --enable-simd --enable-bulk-memory --enable-nontrapping-float-to-int --enable-sign-ext \
    --enable-mutable-globals --enable-multivalue --enable-reference-types wasm/pkg/glasswarp_web_bg.wasm -o wasm/pkg/glasswarp_web_bg.wasm

npx tsc --noEmit
rm -rf dist
npx vite build --mode hosted --logLevel warn
npx vite build --mode single --logLevel warn
mv dist/single/index.html dist/glasswarp.html
rm -r dist/single
node size.mjs
