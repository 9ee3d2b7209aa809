"""Draw splats with Open3D: `python open3d_draw.py IN.npz OUT.npy`, in a process of its own.

Open3D's renderer holds resources until the interpreter ends and may not end cleanly, so no test should
share its process. IN holds columns as Open3D names them and one camera; OUT is uint8 [H, W, 3] on black.
"""

import sys

import numpy as np


def main() -> None:
    import open3d as o3d
    from open3d.visualization import rendering

    columns = np.load(sys.argv[1])
    width, height, K = int(columns["width"]), int(columns["height"]), columns["K"]
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(columns["means"]))
    for name in ("f_dc", "f_rest", "opacity", "scale", "rot"):
        cloud.point[name] = o3d.core.Tensor(columns[name])
    renderer = rendering.OffscreenRenderer(width, height)
    material = rendering.MaterialRecord()
    material.shader = "gaussianSplat"
    material.gaussian_splat_sh_degree = int(columns["sh_degree"])
    renderer.scene.set_background([0, 0, 0, 1])
    renderer.scene.view.set_post_processing(False)
    renderer.scene.add_geometry("splats", cloud, material)
    intrinsic = o3d.camera.PinholeCameraIntrinsic(width, height, K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    renderer.setup_camera(intrinsic, columns["viewmat"])
    np.save(sys.argv[2], np.asarray(renderer.render_to_image()))


if __name__ == "__main__":
    main()
