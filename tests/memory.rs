//! What a design takes of memory, measured as it runs, against what was told beforehand.
#![cfg(target_os = "linux")]

#[path = "common/workshop.rs"]
mod workshop;

use image::{GrayImage, Luma, Rgba};
use std::{
    fs,
    process::{Command, Stdio},
    thread,
    time::Duration,
};
use workshop::{FINE, REFUSED, Workshop};

/// Between these shares of what was told lie the peaks that were measured. Above 1 a design would
/// be killed that was let through.
const BAND: std::ops::RangeInclusive<f64> = 0.5..=1.0;

/// A picture like a photograph: smooth, with grain.
fn draw(shop: &Workshop, name: &str, width: u32, height: u32, colours: bool) {
    let tone = |x: u32, y: u32| {
        let (u, v) = (9.0 * f64::from(x) / f64::from(width), 7.0 * f64::from(y) / f64::from(height));
        (127.0 + 80.0 * u.sin() * v.cos()) as u16 + ((x * 7919 + y * 104_729) % 23) as u16
    };
    if colours {
        let pixel = |x, y| Rgba([257 * tone(x, y), 256 * tone(x, y), 255 * tone(x, y), u16::MAX]);
        image::ImageBuffer::<Rgba<u16>, Vec<u16>>::from_fn(width, height, pixel).save(shop.path(name)).unwrap();
    } else {
        GrayImage::from_fn(width, height, |x, y| Luma([tone(x, y) as u8])).save(shop.path(name)).unwrap();
    }
}

/// Runs a design; its exit code, the greatest resident size that the kernel saw, in MB, and the
/// document that it printed.
fn measured(shop: &Workshop, line: &str, free_mb: u64) -> (Option<i32>, f64, serde_json::Value) {
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("glasswarp"))
        .current_dir(shop.root())
        .env("GLASSWARP_MEMORY", free_mb.to_string())
        .args(line.split(' ').chain(["--json"]))
        .stdin(Stdio::null())
        .stdout(fs::File::create(shop.path("said.json")).unwrap())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let status_file = format!("/proc/{}/status", child.id());
    let mut peak_kib = 0.0;
    // The kernel keeps the greatest size; what grows in the last millisecond of a run is not seen.
    let status = loop {
        let text = fs::read_to_string(&status_file).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        if let Some(kib) = line.and_then(|line| line.split_whitespace().next()?.parse().ok()) {
            peak_kib = f64::max(peak_kib, kib);
        }
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        thread::sleep(Duration::from_millis(1));
    };
    let document = serde_json::from_str(&fs::read_to_string(shop.path("said.json")).unwrap()).unwrap();
    (status.code(), 1.024e-3 * peak_kib, document)
}

#[test]
fn designs_take_what_was_told() {
    let shop = Workshop::new();
    let mut faults = Vec::new();
    for (width, height, colours, flags) in [
        (512, 512, false, "--nodes 257 --no-verify -o b.stl"),
        (512, 512, false, "--nodes 513 --no-verify -o b.stl"),
        (512, 512, false, "--nodes 513 -o b.stl"),
        (512, 512, false, "--nodes 513 -o b.stl -o b.obj -o b.glb"),
        (512, 512, true, "--nodes 513 --quality draft -o b.stl"),
        (250, 1000, false, "--nodes 251 -o b.stl"),
        (1000, 250, true, "--nodes 1001 --quality draft -o b.stl"),
        (1400, 1400, true, "--nodes 257 --no-verify -o b.stl"),
        (1400, 1400, false, "--nodes 701 --quality draft -o b.stl"),
        (512, 512, false, "--nodes 257 --solver warping --no-verify -o b.stl"),
        (512, 512, false, "--nodes 513 --quality draft --outline circle -o b.stl"),
        (512, 512, false, "--nodes 513 --quality draft --tilt 20deg -o b.stl"),
    ] {
        draw(&shop, "p.png", width, height, colours);
        let (code, peak, document) = measured(&shop, &format!("design p.png {flags} --no-report"), 100_000);
        assert_eq!(code, Some(FINE), "{flags}: {document}");
        let told = document["result"]["expected_memory"].as_f64().unwrap() / 1e6;
        let said = format!("{width} x {height} {flags}: {peak:.0} of {told:.0} MB, {:.2}", peak / told);
        println!("{said}");
        if !BAND.contains(&(peak / told)) {
            faults.push(said);
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn what_is_advised_passes_the_guard_and_runs() {
    let shop = Workshop::new();
    for (width, height, flags) in
        [(300, 1200, "-o b.stl"), (1200, 300, "-o b.stl"), (400, 400, "--outline circle -o b.stl")]
    {
        draw(&shop, "p.png", width, height, false);
        let line = format!("design p.png {flags} --no-report --quality draft");
        let free_mb = 170;
        let (code, _, document) = measured(&shop, &format!("{line} --nodes 4097"), free_mb);
        let refusal = document["error"]["message"].as_str().unwrap_or_default().to_owned();
        if code != Some(REFUSED) {
            panic!("{width} x {height}: {document}");
        }
        // A grid beyond what can be is refused as such; one that can be is told what would fit.
        let refusal = if refusal.contains("--nodes ") && refusal.contains("take at most") {
            refusal
        } else {
            let (code, _, document) = measured(&shop, &format!("{line} --nodes 2001"), free_mb);
            assert_eq!(code, Some(REFUSED), "{document}");
            document["error"]["message"].as_str().unwrap().to_owned()
        };
        let advised = refusal.split("take at most --nodes ").nth(1).unwrap_or_else(|| panic!("{refusal}"));
        let nodes: usize = advised.split(',').next().unwrap().parse().unwrap();
        let (code, peak, document) = measured(&shop, &format!("{line} --nodes {nodes}"), free_mb);
        assert_eq!(code, Some(FINE), "{width} x {height}, {nodes} nodes: {document}");
        assert!(peak <= free_mb as f64, "{width} x {height}, {nodes} nodes took {peak:.0} MB");
        let (code, ..) = measured(&shop, &format!("{line} --nodes {}", nodes + 8), free_mb);
        assert_eq!(code, Some(REFUSED), "{width} x {height}: more would have fitted than {nodes}");
    }
}
