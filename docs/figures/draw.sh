#!/usr/bin/env bash
# Draws the pictures of the README and of docs/ that show designs with the program itself.
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build --release
root=$PWD
export PATH=$root/target/release:$PATH
made=$root/target/figures
mkdir -p "$made"
for sample in samples/*/design.toml; do
    name=$(basename "$(dirname "$sample")")
    glasswarp design "$sample" -o "$made/$name.stl" --no-report --pictures
    cp "$made/$name.panel.png" "docs/figures/gallery-$name.png"
done
for kind in panel budget; do cp "$made/camera.$kind.png" "docs/figures/camera.$kind.png"; done
# Of docs/fabrication.md.
glasswarp design samples/letter-f/design.toml --quality draft --nodes 129 --thickness 12mm --rim 10mm,-4mm --mark 5mm \
    --origin stock-top -o "$made/f.step" --no-report --pictures
cp "$made/f.drawing.png" docs/figures/drawing.png
walk=$made/tutorial
mkdir -p "$walk"
cp -r samples "$walk/"
# Every command of the pages, as it stands; a check that finds something wrong ends with 3.
for page in tutorial settings; do
    sed -n '/^```sh$/,/^```$/p' "docs/$page.md" | sed '/^```/d' >"$walk/$page.sh"
    (cd "$walk" && sh "$page.sh" 2>&1 | tee "$page.log")
done
cp "$walk/portrait.png" docs/figures/tutorial-picture.png
for kind in panel contours; do cp "$walk/portrait.$kind.png" "docs/figures/tutorial-$kind.png"; done
for name in check steps; do cp "$walk/$name.png" "docs/figures/tutorial-$name.png"; done
cp "$walk/final.drawing.png" docs/figures/tutorial-drawing.png
cp "$walk/final.panel.png" docs/figures/tutorial-final.png
cp "$walk/window.panel.png" docs/figures/settings-window.png
cp "$walk/torch.panel.png" docs/figures/settings-torch.png
cp "$walk/laser.panel.png" docs/figures/settings-laser.png
shot() {
    chromium --headless --no-sandbox --hide-scrollbars --window-size="$2" --screenshot="docs/figures/$1" "file://$3"
}
shot tutorial-ready.png 900,1270 "$walk/final.ready.html"
shot report.png 1200,1500 "$walk/final.report.html"
