//! TypeScript types of plain objects.
use wasm_bindgen::prelude::*;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
/** The stage of an encoding. */
export type Stage = "refine" | "tighten" | "assemble";

/** What is wrong with a mesh; docs/json.md of tesdf describes the keys of `tesdf check --json`. */
export interface CheckReport {
  vertices: number;
  faces: number;
  min: [number, number, number];
  max: [number, number, number];
  diagonal: number;
  shells: number;
  boundary_loops: { vertices: number[]; closed: boolean; length: number }[];
  winding: [number, number] | null;
  /** Whether the mesh has a well-defined inside. */
  encodable: boolean;
  defects: {
    kind: string;
    severity: "error" | "warning" | "note";
    faces: number[];
    vertices: number[];
    place: [number, number, number];
    message: string;
  }[];
}

/** Options of a detection; docs/architecture.md#collide of tesdf describes them. */
export interface ContactOptions {
  mode: "node" | "face" | "exact";
  /** Contacts are found up to this signed distance. */
  contact_distance?: number;
  reduction?: "none" | { per_pair: number } | { spread: number };
  per?: "face" | "cell" | "minimum";
}
"#;
