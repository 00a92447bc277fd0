//! Table II as text.
use super::Table;
use super::measure::{Count, KEPT, Row};
use crate::tables::output::{Text, short};

const MIB: f64 = 1024.0 * 1024.0;

/// A row in one line.
pub fn line(row: &Row) -> String {
    let [broad, middle, narrow] = row.phases_ms.map(short);
    format!(
        "{}, E_max {}: {} MiB, {broad} / {middle} / {narrow} ms, {} queries",
        row.scenario.name(),
        e_max(row),
        short(row.memory.whole() as f64 / MIB),
        average(&row.paper_form.queries)
    )
}

fn e_max(row: &Row) -> String {
    row.max_entries.map_or("full".into(), |entries| entries.to_string())
}

fn average(count: &Count) -> String {
    format!("{:.0} / {:.0}", count.mean, count.max)
}

pub fn csv(rows: &[Row]) -> Text {
    let columns = [
        "scenario",
        "max_entries",
        "instances",
        "frames",
        "contact_distance",
        "paper_mib",
        "assets_bytes",
        "instances_bytes",
        "detection_bytes",
        "broad_ms",
        "middle_ms",
        "narrow_ms",
        "queries_mean",
        "queries_max",
        "contacts_mean",
        "contacts_max",
        "detection_ms",
        "face_queries_mean",
        "face_queries_max",
        "face_contacts_mean",
        "face_contacts_max",
        "face_detection_ms",
        "kept_mean",
        "kept_max",
    ];
    let line = |row: &Row| {
        let mut cells =
            vec![row.scenario.name().to_string(), row.max_entries.map_or(String::new(), |e| e.to_string())];
        cells.extend([row.instances, row.frames].map(|n| n.to_string()));
        cells.push(row.contact_distance.to_string());
        cells.push(row.memory.paper_mib.to_string());
        cells.extend([row.memory.assets, row.memory.instances, row.memory.detection].map(|n| n.to_string()));
        cells.extend(row.phases_ms.map(|ms| ms.to_string()));
        for cost in [&row.paper_form, &row.per_face] {
            let (queries, contacts) = (cost.queries, cost.contacts);
            let figures = [queries.mean, queries.max, contacts.mean, contacts.max, cost.detection_ms];
            cells.extend(figures.map(|figure| figure.to_string()));
        }
        cells.extend([row.kept.mean, row.kept.max].map(|figure| figure.to_string()));
        cells
    };
    Text { columns: columns.map(str::to_string).to_vec(), rows: rows.iter().map(line).collect() }
}

pub fn markdown(table: &Table) -> String {
    let columns = [
        "scenario".to_string(),
        "E_max".into(),
        "bodies".into(),
        "paper's account".into(),
        "resident".into(),
        "per body, B".into(),
        "BP / MP / NP, ms".into(),
        "queries, avg / max".into(),
        "contacts".into(),
        "queries per face".into(),
        "contacts".into(),
        "detection, ms".into(),
        format!("at most {KEPT} per pair"),
    ];
    let phases = |[broad, middle, narrow]: [f64; 3]| {
        format!("{} / {} / {}", short(broad), short(middle), short(narrow))
    };
    let dash = || "–".to_string();
    let mut rows = Vec::new();
    for row in &table.rows {
        if rows.len() % 3 == 0 {
            let paper = row.scenario.paper();
            let [mean, max] = paper.queries;
            rows.push(vec![
                row.scenario.name().to_string(),
                "*paper: 32*".into(),
                dash(),
                paper.memory.to_string(),
                dash(),
                dash(),
                phases(paper.phases),
                format!("{mean} / {max}"),
                dash(),
                dash(),
                dash(),
                dash(),
                dash(),
            ]);
        }
        rows.push(vec![
            String::new(),
            e_max(row),
            row.instances.to_string(),
            short(row.memory.paper_mib),
            short(row.memory.whole() as f64 / MIB),
            (row.memory.instances / row.instances.max(1)).to_string(),
            phases(row.phases_ms),
            average(&row.paper_form.queries),
            average(&row.paper_form.contacts),
            average(&row.per_face.queries),
            average(&row.per_face.contacts),
            short(row.per_face.detection_ms),
            average(&row.kept),
        ]);
    }
    let frames = table.rows.first().map_or(0, |row| row.frames);
    format!(
        "{}\nUp to {frames} recorded frames, {} measurements of each, preset {}, contacts found on: {}; the paper \
         measured on an RTX 5090. Memory in MiB. The columns up to the first *contacts* are Face-TES with K = 16 and \
         cos θ = 0.3; those after it are the exact minimum with local minima as contacts, on the processor.\n\n{}",
        crate::heading::lines(),
        table.repeat,
        table.preset,
        table.device,
        Text { columns: columns.to_vec(), rows }.markdown(2)
    )
}
