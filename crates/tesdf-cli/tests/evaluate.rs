//! The figures of a quick Table I from `tesdf evaluate`, and the formats of its output.
mod folder;

use folder::Folder;
use serde_json::Value;

fn meshes() -> String {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data").display().to_string()
}

fn evaluated(args: &[&str]) -> String {
    let data = meshes();
    Folder::new().good(&[&["evaluate"], args, &["--data", &data]].concat())
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
    for text in
        ["`tesdf evaluate table1 --meshes beam", "Grid: 20 voxels", "| deformed beam, bent 29° | file |"]
    {
        assert!(md.contains(text), "{md}");
    }
}

#[test]
fn missing_meshes_are_errors() {
    let folder = Folder::new();
    let (code, _, err) = folder.tesdf(&["evaluate", "table1", "--quick"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("there is no mesh") && err.contains("--data"), "{err}");
    let (code, _, err) = folder.tesdf(&["evaluate", "table1", "--meshes", "bolt,washer"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("no mesh washer") && err.contains("bolt, nut"), "{err}");
}

#[test]
fn a_folder_that_cannot_be_made_is_reported_before_the_work() {
    let folder = Folder::new();
    folder.write("file", "in the way");
    let data = meshes();
    let args = ["evaluate", "table4", "--grid", "4096", "--data", &data, "-o", "file/results"];
    let (code, _, err) = folder.tesdf(&args);
    assert_eq!(code, Some(2));
    assert!(err.contains("cannot make the folder file/results"), "{err}");
}

#[test]
fn the_quick_table_3_has_encoded_meshes_that_succeed_beside_voxels_and_the_paper() {
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").display().to_string();
    let folder = Folder::new();
    folder.good(&["evaluate", "table3", "--quick", "--scenes", &scenes, "-o", "results"]);
    let read = |name: &str| std::fs::read_to_string(folder.path(name)).unwrap();
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
        "`tesdf evaluate table3 --quick",
        "## bolt-nut: 100 µm",
        "| 5 | *paper* | F/F/F | node S/S/S, face S/S/S |",
    ] {
        assert!(md.contains(part), "{part}: {md}");
    }
}
