#!/usr/bin/env bash
# Draws the pictures of docs/gallery.md and docs/tutorial.md with the program itself.
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build --release
root=$PWD
export PATH=$root/target/release:$PATH
made=$root/target/figures
mkdir -p "$made"
for sample in samples/*/design.toml; do
    name=$(basename "$(dirname "$sample")")
    glasswarp design "$sample" -o "$made/$name.stl" --no-report
    cp "$made/$name.panel.png" "docs/figures/gallery-$name.png"
done
walk=$made/tutorial
mkdir -p "$walk"
cp -r samples "$walk/"
# Every command of the page, as it stands; a check that finds something wrong ends with 3.
sed -n '/^```sh$/,/^```$/p' docs/tutorial.md | sed '/^```/d' >"$walk/walk.sh"
(cd "$walk" && sh walk.sh)
cp "$walk/portrait.png" docs/figures/tutorial-picture.png
for kind in panel contours; do cp "$walk/portrait.$kind.png" "docs/figures/tutorial-$kind.png"; done
for name in check steps; do cp "$walk/$name.png" "docs/figures/tutorial-$name.png"; done
cp "$walk/final.drawing.png" docs/figures/tutorial-drawing.png
