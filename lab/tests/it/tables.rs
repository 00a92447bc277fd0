//! The figures of quick tables, and the formats of their output.

use crate::folder::{Folder, data, scene};
use serde_json::Value;
use tesdf_sim::RunRecord;

fn meshes() -> String {
    data("")
}

fn evaluated(args: &[&str]) -> String {
    let data = meshes();
    Folder::new().good(&[args, &["--data", &data]].concat())
}

fn is_exact(figures: &Value) -> bool {
    let on_grid = &figures["on_grid"];
    on_grid["max_error"].as_f64().unwrap() <= on_grid["exact"].as_f64().unwrap()
        && on_grid["cells_inexact"] == 0
        && figures["exactness_band"] == 1.0
        && figures["one_percent_band"] == 1.0
}

#[test]
fn the_quick_table_1_has_full_lists_without_error_beside_the_paper() {
    let table: Value = serde_json::from_str(&evaluated(&["table1", "--quick", "--format", "json"])).unwrap();
    let rows = table["rows"].as_array().unwrap();
    let paper: Vec<&Value> = rows.iter().filter(|r| r["from"] == "paper").collect();
    assert_eq!(paper.len(), 3, "shaft, gripper and deformed gripper");
    assert_eq!(paper[0]["truncated"]["exactness_band"], 0.105);
    let mut seen = [0; 4];
    for row in rows.iter().filter(|r| r["from"] == "tesdf") {
        let (full, truncated) = (&row["full"], &row["truncated"]);
        assert!(full["on_grid"]["points_inside"].as_u64().unwrap() > 1000, "{row:#}");
        let band = |f: &Value| f["exactness_band"].as_f64().unwrap();
        let one_percent = |f: &Value| f["one_percent_band"].as_f64().unwrap();
        for figures in [full, truncated] {
            assert!((0.0..=1.0).contains(&band(figures)) && band(figures) <= one_percent(figures), "{row:#}");
            assert!(figures["max_error_percent"].as_f64().unwrap() < 100.0, "{row:#}");
        }
        assert!(truncated["longest_list"].as_u64() <= full["longest_list"].as_u64());
        let (deformed, reencoded) = (row["bend_degrees"].is_f64(), row["reencoded"].is_object());
        match (row["encoder"] == "certified", deformed, reencoded) {
            (true, false, _) => {
                seen[0] += 1;
                assert!(is_exact(full), "{row:#}");
                if full["longest_list"].as_u64() > Some(32) {
                    seen[1] += 1;
                    assert!(!is_exact(truncated) && band(truncated) > 0.0, "{row:#}");
                }
            }
            (true, true, false) => {
                seen[2] += 1;
                assert!(!is_exact(full) && band(full) > 0.151, "{row:#}");
            }
            (true, true, true) => {
                seen[3] += 1;
                assert!(is_exact(full), "{row:#}");
                assert!(row["reencoded"]["stale"].as_u64() < row["reencoded"]["cells"].as_u64());
            }
            _ => {}
        }
    }
    assert!(seen.iter().all(|&n| n > 0), "{seen:?}");
}

#[test]
fn table_4_gets_better_with_longer_lists() {
    let options = ["table4", "--quick", "--resolution", "2"];
    let table: Value =
        serde_json::from_str(&evaluated(&[&options[..], &["--format", "json"]].concat())).unwrap();
    let certified = table["rows"].as_array().unwrap().iter().find(|r| r["encoder"] == "certified").unwrap();
    let columns = certified["columns"].as_array().unwrap();
    assert_eq!(columns.len(), 9);
    assert!(!is_exact(&columns[0]) && is_exact(&columns[8]), "{certified:#}");
    let bands = columns.iter().map(|c| c["exactness_band"].as_f64().unwrap());
    assert!(bands.is_sorted(), "{certified:#}");
}

#[test]
fn tables_are_printed_as_csv_and_markdown() {
    let options = ["table1", "--meshes", "beam", "--grid", "20", "--resolution", "2"];
    let csv = evaluated(&[&options[..], &["--format", "csv"]].concat());
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let column = reader.headers().unwrap().iter().position(|c| c == "exactness_band").unwrap();
    let bands: Vec<f64> = reader.records().map(|r| r.unwrap()[column].parse().unwrap()).collect();
    assert_eq!(bands.len(), 18, "three encodings, three shapes, full and truncated");
    assert_eq!(bands[0], 1.0);
    let md = evaluated(&options);
    for text in ["`tesdf-lab table1 --meshes beam", "Grid: 20 voxels", "| deformed beam, bent 29° | file |"]
    {
        assert!(md.contains(text), "{md}");
    }
}

#[test]
fn missing_meshes_are_errors() {
    let folder = Folder::new();
    let (code, _, err) = folder.lab(&["table1", "--quick"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("there is no mesh") && err.contains("--data"), "{err}");
    let (code, _, err) = folder.lab(&["table1", "--meshes", "bolt,washer"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("no mesh washer") && err.contains("bolt, nut"), "{err}");
}

#[test]
fn a_folder_that_cannot_be_made_is_reported_before_the_work() {
    let folder = Folder::new();
    folder.write("file", "in the way");
    let data = meshes();
    let args = ["table4", "--grid", "4096", "--data", &data, "-o", "file/results"];
    let (code, _, err) = folder.lab(&args);
    assert_eq!(code, Some(2));
    assert!(err.contains("cannot make the folder file/results"), "{err}");
}

#[test]
fn table_2_counts_the_queries_of_recorded_poses_beside_the_paper() {
    let folder = Folder::new();
    let recordings = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings");
    let args = ["table2", "--scenarios", "peg-in-hole", "--frames", "1", "--repeat", "1", "--preset", "fast"];
    folder.good(&[&args[..], &["--recordings", recordings, "-o", "results"]].concat());
    let read = |name: &str| folder.read(name);
    let table: Value = serde_json::from_str(&read("results/table2.json")).unwrap();
    let rows = table["rows"].as_array().unwrap();
    assert_eq!(rows.iter().map(|r| r["max_entries"].as_u64()).collect::<Vec<_>>(), [Some(32), None]);
    let mean = |figure: &Value| figure["mean"].as_f64().unwrap();
    for row in rows {
        let (cells, faces) = (&row["paper_form"], &row["per_face"]);
        // A face meets several cells, and not each of them has a contact.
        assert!(mean(&cells["queries"]) > mean(&faces["queries"]), "{row:#}");
        assert!(mean(&cells["queries"]) > mean(&cells["contacts"]), "{row:#}");
        assert!(mean(&faces["contacts"]) > 64.0 && mean(&row["kept"]) == 64.0, "{row:#}");
        assert!(row["memory"]["assets"].as_u64() > row["memory"]["instances"].as_u64(), "{row:#}");
    }
    let account = |row: &Value| row["memory"]["paper_mib"].as_f64().unwrap();
    assert!(account(&rows[0]) < account(&rows[1]), "truncated lists are smaller");
    assert_eq!(read("results/table2.csv").lines().count(), 3);
    assert!(read("results/table2.md").contains("| peg-in-hole | *paper: 32* |"));
}

#[test]
fn the_quick_table_3_has_encoded_meshes_that_succeed_beside_voxels_and_the_paper() {
    let scenes = scene("");
    let folder = Folder::new();
    let args = ["table3", "--quick", "--preset", "fast", "--scenes", &scenes, "-o", "results"];
    folder.good(&args);
    let read = |name: &str| folder.read(name);
    let table: Value = serde_json::from_str(&read("results/table3.json")).unwrap();
    let cells = table["cells"].as_array().unwrap();
    // Two scenes, each with voxels and encoded.
    assert_eq!(cells.len(), 4);
    for cell in cells {
        assert_eq!(cell["success"] == true, cell["failures"].as_array().unwrap().is_empty(), "{cell:#}");
        assert!(cell["contacts"].as_f64() > Some(100.0), "{cell:#}");
        if cell["voxels"].is_null() {
            assert_eq!(cell["success"], true, "{cell:#}");
            let tolerance = cell["tolerance_um"].as_f64().unwrap();
            assert!(cell["penetration_um"].as_f64().unwrap() < 0.1 * tolerance, "{cell:#}");
        }
    }
    let grids = table["voxels"].as_array().unwrap();
    assert_eq!(grids.len(), 4, "a grid for each body");
    for grid in grids {
        assert!(grid["sparse_bytes"].as_u64() < grid["dense_bytes"].as_u64(), "{grid:#}");
        let error = grid["accuracy"]["max_error"].as_f64().unwrap();
        assert!(error > 0.0 && error < grid["voxel"].as_f64().unwrap(), "{grid:#}");
    }
    for encoded in table["encoded"].as_array().unwrap() {
        assert!(encoded["whole_bytes"].as_u64() < Some(10_000_000), "{encoded:#}");
    }
    assert_eq!(read("results/table3.csv").lines().count(), 5);
    let md = read("results/table3.md");
    for part in [
        "`tesdf-lab table3 --quick",
        "## bolt-nut: 100 µm",
        "| 5 | *paper* | F/F/F | node S/S/S, face S/S/S |",
    ] {
        assert!(md.contains(part), "{part}: {md}");
    }
}

#[test]
fn in_table_3_tighter_fits_and_longer_steps_than_the_papers_have_no_voxels() {
    let scenes = scene("");
    let folder = Folder::new();
    let args = ["table3", "--quick", "--preset", "fast", "--scenes", &scenes, "-o", "results"];
    folder.good(&[&args[..], &["--tolerances", "150,10,20", "--time-steps", "10"]].concat());
    let read = |name: &str| folder.read(name);
    let table: Value = serde_json::from_str(&read("results/table3.json")).unwrap();
    let cells = table["cells"].as_array().unwrap();
    let tolerances: Vec<_> = cells.iter().map(|cell| cell["tolerance_um"].as_u64().unwrap()).collect();
    assert_eq!(tolerances, [10, 150, 20]);
    for cell in cells {
        assert!(cell["voxels"].is_null() && cell["success"] == true, "{cell:#}");
    }
    assert_eq!(table["voxels"].as_array().unwrap().len(), 0);
    let md = read("results/table3.md");
    assert!(md.contains("| 10 | node | –/– | S/S |"), "{md}");
}

/// The JSON of a quick figure, and its folder with all files.
fn quick_figure(name: &str, more: &[&str]) -> (Folder, Value) {
    let scenes = scene("");
    let (folder, data) = (Folder::new(), meshes());
    let args = [name, "--quick", "--scenes", &scenes, "--data", &data, "-o", "results"];
    folder.good(&[&args[..], more].concat());
    let read = |end: &str| std::fs::read_to_string(folder.path(&format!("results/{name}.{end}"))).unwrap();
    let svg = read("svg");
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{svg}");
    assert!(read("md").contains(&format!("`tesdf-lab {name} --quick")), "{}", read("md"));
    let figure = serde_json::from_str(&read("json")).unwrap();
    (folder, figure)
}

#[test]
fn deep_shafts_come_apart_in_the_quick_figure_8_even_with_truncated_lists() {
    let (folder, figure) = quick_figure("fig8", &["--runs", "runs"]);
    assert_eq!(figure["shafts"], 24);
    let rows = figure["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 6, "three modes, truncated and full");
    for row in rows {
        let depths: Vec<f64> =
            row["penetration"].as_array().unwrap().iter().map(|d| d.as_f64().unwrap()).collect();
        assert_eq!(depths.len(), 11, "{row:#}");
        assert!(depths[0] > 5e-3, "the pile begins with deep overlaps: {row:#}");
        assert!(depths[10] < 0.2 * depths[0], "{row:#}");
        assert_eq!(row["success"] == true, row["failures"].as_array().unwrap().is_empty(), "{row:#}");
        if row["mode"] == "exact" && row["max_entries"].is_null() {
            assert_eq!(row["success"], true, "{row:#}");
            assert!(row["resolved_at"].as_u64() <= Some(6), "{row:#}");
        }
    }
    let csv = std::fs::read_to_string(folder.path("results/fig8.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 6 * 11);
    let runs = std::fs::read_dir(folder.path("runs")).unwrap().count();
    assert_eq!(runs, 6);
    RunRecord::open(folder.path("runs/pile-bisection-face-32.tesrun")).unwrap();
}

/// Devices and numbers of shafts. On a device six, because a software driver takes seconds for a
/// detection of more. They do not touch.
const DEVICES: &[(&str, &str)] =
    if cfg!(feature = "gpu") { &[("cpu", "24"), ("gpu", "6")] } else { &[("cpu", "24")] };

#[test]
fn the_quick_figure_9_has_fewer_queries_at_the_end_of_the_pile() {
    for &(device, shafts) in DEVICES {
        let (_folder, figure) =
            quick_figure("fig9", &["--device", device, "--shafts", shafts, "--repeat", "1"]);
        let rows = figure["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 6, "three settings at two frames");
        let count = |row: &Value, name: &str| row[name].as_u64().unwrap_or_else(|| panic!("{name}: {row:#}"));
        for (start, end) in rows[..3].iter().zip(&rows[3..]) {
            assert_eq!(start["max_entries"], end["max_entries"]);
            let [start_queries, end_queries] = [start, end].map(|row| count(row, "queries"));
            assert!(start_queries > end_queries || device == "gpu", "{start:#} {end:#}");
            assert!(end_queries > 0, "{end:#}");
            assert!(start["detection_ms"].as_f64() > Some(0.0), "{start:#}");
        }
        assert_eq!(rows[0]["ratio"], 1.0);
        assert!(count(&rows[0], "longest_list") < count(&rows[2], "longest_list"));
        let counted = rows.iter().all(|row| row["distances"].as_u64() > row["evaluations"].as_u64());
        assert_eq!(counted, device == "gpu", "{figure:#}");
        assert_eq!(rows[0]["narrow_ms"].is_null(), device == "cpu");
    }
}

#[test]
fn a_table_is_no_mesh() {
    let folder = Folder::new();
    std::fs::create_dir_all(folder.path("data/procedural")).unwrap();
    std::fs::create_dir(folder.path("tables")).unwrap();
    let [mesh, table] =
        ["data/procedural/shaft_keyway.obj", "tables/table4.csv"].map(|name| folder.path(name));
    folder.write("data/procedural/shaft_keyway.obj", "precious");
    std::fs::hard_link(&mesh, &table).unwrap();
    let (code, _, err) = folder.lab(&["table4", "--quick", "--data", "data", "-o", "tables"]);
    assert!(
        code == Some(2) && err.contains("table4.csv is the input data/procedural/shaft_keyway.obj"),
        "{err}"
    );
    assert_eq!(folder.read("data/procedural/shaft_keyway.obj"), "precious");
}
