//! The figures of the paper: H. Ji, Y. Lee, D. Lee, *TE-SDF: Tetra-Encoded Signed Distance Field
//! for Memory-Efficient and Accurate Collision Detection*, Tables I to IV, and Figures 8 and 9.
//! Memory is in MiB; `docs/paper-map.md` gives the reason. Table III prints it as Mb.

/// A row of Table I. Pairs are for full lists and for E_max = 32.
pub struct Table1 {
    pub name: &'static str,
    pub vertices: usize,
    pub faces: usize,
    pub tetrahedra: usize,
    /// Q and ε, as printed.
    pub sampling: Option<(u32, f64)>,
    pub list_mean: f64,
    pub longest_list: usize,
    pub memory: [f64; 2],
    pub max_error_percent: [f64; 2],
    pub exactness_band: [f64; 2],
    pub one_percent_band: [f64; 2],
}

/// Table I.
pub const TABLE_1: [Table1; 7] = [
    Table1 {
        name: "M16 bolt",
        vertices: 13695,
        faces: 23418,
        tetrahedra: 63164,
        sampling: Some((128, 0.0)),
        list_mean: 10.7,
        longest_list: 437,
        memory: [3.580, 3.260],
        max_error_percent: [0.0, 35.7],
        exactness_band: [1.0, 0.121],
        one_percent_band: [1.0, 0.373],
    },
    Table1 {
        name: "M16 Nut",
        vertices: 3147,
        faces: 5968,
        tetrahedra: 9142,
        sampling: Some((128, 0.0)),
        list_mean: 8.4,
        longest_list: 59,
        memory: [0.436, 0.433],
        max_error_percent: [0.0, 52.6],
        exactness_band: [1.0, 0.406],
        one_percent_band: [1.0, 0.489],
    },
    Table1 {
        name: "Hole",
        vertices: 4559,
        faces: 8448,
        tetrahedra: 22405,
        sampling: Some((128, 0.0)),
        list_mean: 7.36,
        longest_list: 30,
        memory: [0.975, 0.975],
        max_error_percent: [0.0, 0.0],
        exactness_band: [1.0, 1.0],
        one_percent_band: [1.0, 1.0],
    },
    Table1 {
        name: "Shaft",
        vertices: 1881,
        faces: 3334,
        tetrahedra: 6111,
        sampling: Some((256, 1e-7)),
        list_mean: 29.4,
        longest_list: 280,
        memory: [0.782, 0.598],
        max_error_percent: [0.0, 28.4],
        exactness_band: [1.0, 0.105],
        one_percent_band: [1.0, 0.114],
    },
    Table1 {
        name: "Spoon",
        vertices: 2588,
        faces: 3138,
        tetrahedra: 12301,
        sampling: Some((128, 1e-9)),
        list_mean: 15.8,
        longest_list: 35,
        memory: [0.941, 0.941],
        max_error_percent: [0.0, 0.73],
        exactness_band: [1.0, 0.158],
        one_percent_band: [1.0, 1.0],
    },
    Table1 {
        name: "Gripper",
        vertices: 3353,
        faces: 5176,
        tetrahedra: 11429,
        sampling: Some((64, 0.0)),
        list_mean: 16.1,
        longest_list: 33,
        memory: [0.888, 0.888],
        max_error_percent: [0.0, 7e-3],
        exactness_band: [1.0, 0.97],
        one_percent_band: [1.0, 1.0],
    },
    Table1 {
        name: "Deformed gripper",
        vertices: 3353,
        faces: 5176,
        tetrahedra: 11429,
        sampling: None,
        list_mean: 16.1,
        longest_list: 33,
        memory: [0.888, 0.888],
        max_error_percent: [8.9, 8.9],
        exactness_band: [0.151, 0.151],
        one_percent_band: [0.303, 0.303],
    },
];

/// The row of Table I with this name.
pub fn table_1(name: &str) -> Option<&'static Table1> {
    TABLE_1.iter().find(|row| row.name == name)
}

/// A row of Table II, measured on an Intel Core i9-13900K and an NVIDIA RTX 5090.
pub struct Table2 {
    pub memory: f64,
    /// Times of the broad, middle and narrow phase, ms.
    pub phases: [f64; 3],
    /// Narrow-phase queries: on average and at most.
    pub queries: [u32; 2],
}

/// Table II: robo-assembly, chained SAM, engine transmission, bolt-nut, peg-in-hole, pile of
/// shafts.
pub const TABLE_2: [Table2; 6] = [
    Table2 { memory: 5.80, phases: [0.81, 0.10, 0.10], queries: [9094, 16_711] },
    Table2 { memory: 52.91, phases: [2.1, 0.20, 0.49], queries: [140_097, 185_370] },
    Table2 { memory: 8.05, phases: [0.71, 0.09, 0.08], queries: [2073, 4513] },
    Table2 { memory: 3.69, phases: [1.41, 0.19, 0.14], queries: [20_746, 26_185] },
    Table2 { memory: 2.59, phases: [0.70, 0.15, 0.21], queries: [38_424, 55_600] },
    Table2 { memory: 88.24, phases: [1.71, 0.09, 0.05], queries: [8053, 150_678] },
];

/// One half of Table III. A cell has a letter for each tolerance: S for success, F for failure.
pub struct Table3 {
    /// Quality settings of the moving and the fixed body, for each voxel column.
    pub qualities: [[u32; 2]; 4],
    /// Time step, ms, and the cells of the voxel columns, of Node-TES and of Face-TES.
    pub rows: [(f64, [&'static str; 6]); 3],
    /// Memory of the voxel columns and of TES, as printed.
    pub memory: [f64; 5],
}

/// Table III, bolt and nut: tolerances of 100, 50 and 25 µm.
pub const TABLE_3_NUT: Table3 = Table3 {
    qualities: [[256, 256], [512, 512], [512, 1024], [1024, 1024]],
    rows: [
        (1.0, ["F/F/F", "S/F/F", "S/S/F", "S/S/F", "S/S/S", "S/S/S"]),
        (3.0, ["F/F/F", "S/F/F", "S/S/F", "S/S/F", "S/S/S", "S/S/S"]),
        (5.0, ["F/F/F", "S/F/F", "S/S/F", "S/S/F", "S/S/S", "S/S/S"]),
    ],
    memory: [15.82, 126.26, 502.08, 1007.52, 3.69],
};

/// Table III, peg in hole: tolerances of 150, 100 and 50 µm.
pub const TABLE_3_PEG: Table3 = Table3 {
    qualities: [[256, 512], [512, 256], [512, 512], [1024, 1024]],
    rows: [
        (1.0, ["F/F/F", "S/S/F", "S/S/F", "S/S/S", "S/S/S", "S/S/S"]),
        (3.0, ["S/F/F", "S/S/F", "S/S/F", "S/S/S", "S/S/S", "S/S/S"]),
        (5.0, ["S/F/F", "S/S/F", "S/S/F", "S/S/S", "S/S/S", "S/S/S"]),
    ],
    memory: [70.20, 45.54, 102.41, 815.03, 2.59],
};

/// A column of Table IV.
pub struct Table4 {
    /// E_max.
    pub max_entries: u32,
    pub memory: f64,
    pub max_error_percent: f64,
    pub exactness_band: f64,
    pub one_percent_band: f64,
}

const fn column(
    max_entries: u32,
    [memory, max_error_percent, exactness_band, one_percent_band]: [f64; 4],
) -> Table4 {
    Table4 { max_entries, memory, max_error_percent, exactness_band, one_percent_band }
}

/// Table IV; the first and the last column are those of the shaft in Table I, as its caption says.
pub const TABLE_4: [Table4; 9] = [
    column(32, [0.598, 28.4, 0.105, 0.114]),
    column(64, [0.709, 22.74, 0.215, 0.282]),
    column(96, [0.750, 18.28, 0.307, 0.395]),
    column(128, [0.770, 16.57, 0.399, 0.536]),
    column(160, [0.778, 14.07, 0.505, 0.555]),
    column(192, [0.781, 3.38, 0.545, 0.555]),
    column(224, [0.782, 0.02, 0.601, 1.0]),
    column(256, [0.782, 0.0, 1.0, 1.0]),
    column(288, [0.782, 0.0, 1.0, 1.0]),
];

/// E_max of Figure 8.
pub const FIGURE_8_MAX_ENTRIES: u32 = 32;

/// The frame of Figure 8 at which the penetrations are resolved.
pub const FIGURE_8_RESOLVED_AT: u32 = 6;

/// Narrow-phase queries of the frames of Figure 9, from Sec. VII-D.
pub const FIGURE_9_QUERIES: [(&str, u32); 2] = [("start", 150_678), ("end", 8_208)];
