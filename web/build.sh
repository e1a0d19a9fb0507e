#!/usr/bin/env bash
# Builds the browser app: the library for WebAssembly, and the page around it, hosted and as one file. What it takes is in README.md.
#
# The installed Rust toolchain may have no standard library for wasm32: Debian's rustc-web has its source, and cargo builds it. With
# `WASM_CARGO` and `WASM_RUSTC` other compilers can be named; nothing of this leaks into native builds.
set -euo pipefail
cd "$(dirname "$0")"

export CARGO_TARGET_DIR=${GLASSWARP_WASM_TARGET:-$PWD/../target/wasm}
wasm=$CARGO_TARGET_DIR/wasm32-unknown-unknown/release/glasswarp_web.wasm

[ -d node_modules/vite ] || npm ci --silent --no-audit --no-fund

# What is inlined where everything is linked is limited: smaller, and no slower.
small=(-Cllvm-args=-inline-threshold=5)
(
    cd wasm
    # Memory that workers share, of which each thread has a part of its own. Made without cross-origin isolation it stays with one worker.
    export RUSTFLAGS='-C target-feature=+simd128,+atomics,+bulk-memory,+mutable-globals'
    for argument in shared-memory import-memory max-memory=4294967296 \
        export=__wasm_init_tls export=__tls_size export=__tls_align export=__tls_base export=__heap_base; do
        RUSTFLAGS+=" -C link-arg=--$argument"
    done
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
cargo run --quiet --locked --package glasswarp-bindgen -- "$wasm" wasm/pkg
npx wasm-opt -Oz --converge --strip-debug --strip-producers --enable-simd --enable-threads --enable-bulk-memory --enable-nontrapping-float-to-int --enable-sign-ext \
    --enable-mutable-globals --enable-multivalue --enable-reference-types wasm/pkg/glasswarp_web_bg.wasm -o wasm/pkg/glasswarp_web_bg.wasm

npx tsc --noEmit
rm -rf dist
npx vite build --mode hosted --logLevel warn
npx vite build --mode single --logLevel warn
mv dist/single/index.html dist/glasswarp.html
rm -r dist/single
node size.mjs
