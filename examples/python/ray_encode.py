"""Encodes the meshes of a folder on all machines of a Ray cluster, or on all processors of this one.

python examples/python/ray_encode.py [MESHES [OUT]]

`tesdf encode-all` does the same without Ray, on one machine or with --shard on several.
"""

import hashlib
import sys
import tempfile
from pathlib import Path

import ray
import tesdf

MESHES = Path(__file__).resolve().parents[2] / "crates/tesdf/tests/data/bad"  # half of them are no solids


@ray.remote(max_retries=3)  # when its worker dies; an error of the mesh is a result
def encode(job):
    mesh, out = map(Path, job)  # paths, which every machine sees; a mesh would be copied through Ray
    try:
        content = f"fast {mesh.name} ".encode() + mesh.read_bytes()  # the asset follows from these
        asset = out / f"{hashlib.sha256(content).hexdigest()[:32]}.tesdf"
        if not asset.exists():  # save() writes a file whole or not at all
            tesdf.encode(mesh, "fast", threads=1).save(asset)
        return mesh, asset, None
    except (OSError, ValueError) as error:
        return mesh, None, str(error)


def encode_all(meshes, out):
    """Each mesh with its asset or an error, as they end; 100 tasks wait at a time."""
    jobs = ((str(mesh), str(out)) for mesh in meshes)
    return ray.util.map_unordered(encode, jobs, backpressure_size=100)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else MESHES
    out = Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp())
    out.mkdir(parents=True, exist_ok=True)
    meshes = [file for file in folder.rglob("*") if file.suffix in {".stl", ".obj", ".ply", ".off", ".glb"}]
    results = list(encode_all(meshes, out))
    for mesh, _, error in results[:]:
        if error:
            print(f"{mesh.name}: {error[:100]}")
    failed = sum(error is not None for *_, error in results)
    print(f"{len(meshes)} meshes: {len(meshes) - failed} assets in {out}, {failed} failed")
    assert all(asset is None or len(tesdf.Asset.open(asset).faces) for _, asset, _ in results)
