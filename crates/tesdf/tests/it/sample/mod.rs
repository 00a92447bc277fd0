//! Small glTF and OFF samples, generated here so that tests can vary them.
#![allow(dead_code, reason = "each test program uses its own part")]

/// A tetrahedron (0, x, y, z) as positions (f32) and twelve indices (u8): 48 + 12 bytes.
pub fn tetrahedron_buffer() -> Vec<u8> {
    let positions: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.];
    let mut buffer: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
    buffer.extend([0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]);
    buffer
}

/// glTF JSON for that buffer. `uri` is the buffer's `uri` member with a comma, or empty.
pub fn json(uri: &str, nodes: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
{{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":12}}],
"buffers":[{{{uri}"byteLength":60}}]}}"#
    )
}

pub fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    out.extend((binary.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(binary);
    out
}

/// The buffer of [`tetrahedron_buffer`] in base64.
pub const DATA_URI: &str = concat!(
    r#""uri":"data:application/octet-stream;base64,"#,
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/",
    r#"AAIBAAEDAQIDAgAD","#
);

pub const OFF: &str = "COFF\n4 4 6\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n0 0 1 1 0 0 1\n\
    3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3 # last\n";
