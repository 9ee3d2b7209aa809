"""Stiff and extreme scenes: each line of the list, its outcome, and the tests that hold it.

Outcomes: "drawn" rightly, "dropped" and counted, "refused" by name. Wherever it is drawn, no value is NaN
or infinite, in float32 and float64, for every lock, order and filter (`test_pictures.py`,
`test_passes.py`), and boxes are right to 1e-4 against extended precision (`test_boxes.py`). Nothing here
can hang: scenes are small, and what is large on purpose (rows, pixels, repetitions) is bounded by its size.

Bounds, as measured: boxes of float64 scenes 1e-12 up to an aspect ratio of 1e8 and 2e-8 at 1e12; boxes of
float32 scenes half a unit in the last place at any aspect ratio, distance or size, as geometry is float64
inside; pictures of float32 scenes 5e-6 off those of float64 in the mean. Not sound: coordinates beyond
1e150 in float64, whose squares overflow; in float32 the order of strokes whose depths agree to seven digits.
Slow: the soft order compares all faint strokes within their softness (1000 that fill 400 x 400 pixels at
opacity 0.02 take 5 s of processor time, and four times as many sixteen times as long).
"""

_TABLE = """
zero or unnormalised quaternions
    dropped  test_files.py::test_zero_quaternions_are_dropped_and_others_normalised_where_used
    drawn    ../rendering/test_project.py::test_the_length_of_a_quaternion_does_not_matter
NaN or Inf in any column
    dropped  test_files.py::test_nan_or_infinity_in_any_column_is_dropped_and_counted_where_it_means_nothing
    refused  ../test_scene.py::test_values_out_of_range_are_refused_by_column_and_row
+Inf opacity logit and -Inf log-scale (legitimate: opacity 1, scale 0)
    drawn    test_files.py::test_opacity_one_and_scale_zero_are_painted_as_what_they_are
    drawn    ../io/test_ply.py::test_infinite_logs_that_mean_something_are_read_as_what_they_mean
900,000 all-zero rows
    dropped  test_files.py::test_nine_hundred_thousand_all_zero_rows_beside_a_scene
    drawn    test_passes.py::test_many_equal_gaussians_are_clustered_as_fast_as_others
scale ratios to 1e7
    drawn    test_boxes.py::test_float64_boxes_are_right_to_a_millionth_of_the_promise
    drawn    test_boxes.py::test_float32_boxes_are_those_of_float64_rounded
    drawn    scene: discs of ratio 1e7
    drawn    scene: needles of ratio 1e7
needles end-on and across the near plane
    drawn    test_boxes.py::test_needles_seen_end_on_keep_both_extents
    drawn    ../rendering/test_project.py::test_a_needle_through_the_near_plane_has_a_finite_box
    drawn    scene: needles end-on
    drawn    scene: needles through the near plane
a Gaussian around the camera
    drawn    scene: Gaussians around the camera
    drawn    scene: the camera in a mean
one stroke that would fill the screen 100 times over (fade it, do not pop it)
    dropped  ../rendering/test_track.py::test_a_stroke_that_comes_near_fades_and_does_not_vanish_at_once
    drawn    scene: strokes that fill the screen 100 times
extents of +-2e7 around a subject at the origin
    drawn    scene: extents of 2e7
    drawn    ../passes/reduce/test_cluster.py::test_strays_at_the_end_of_the_world_do_not_take_the_clusters
scenes 1e-4 and 1e4 units wide
    drawn    scene: 1e-4 wide
    drawn    scene: 1e4 wide
    drawn    ../passes/test_laws.py::test_the_unit_of_the_scene_does_not_count
exactly isotropic and exactly horizontal or vertical strokes
    drawn    scene: isotropic
    drawn    ../rendering/test_project.py::test_round_things_have_angle_zero
    drawn    ../rendering/test_project.py::test_horizontal_is_zero_and_vertical_is_plus_a_quarter_turn
    drawn    scene: horizontal
    drawn    scene: vertical
sub-pixel strokes
    drawn    scene: sub-pixel strokes
    dropped  ../rendering/test_track.py::test_a_stroke_that_goes_far_away_fades_in_proportion_to_its_length
equal depths
    drawn    scene: equal depths
    drawn    ../rendering/test_project.py::test_ties_in_depth_keep_the_order_of_the_rows
    drawn    ../rendering/test_soft.py::test_the_order_of_rows_of_equal_depth_changes_nothing
N = 0, 1, 2
    drawn    test_passes.py::test_no_one_and_two_gaussians_go_all_the_way
    dropped  scene: N = 0
    drawn    scene: N = 1
    drawn    scene: N = 2
k >= N
    drawn    test_passes.py::test_as_many_strokes_as_gaussians_or_more_are_the_scene_itself
all colours equal
    drawn    scene: all colours equal
all positions equal
    drawn    scene: all positions equal
SH degrees 0-3 and missing f_rest
    drawn    test_files.py::test_every_encoding_and_degree_is_painted_alike
    refused  ../io/test_bad_files.py::test_f_rest_that_are_no_whole_bands
linear scales or xyzw quaternions in the file (detected and named, cured on request)
    drawn    test_files.py::test_columns_in_another_encoding_are_loaded_and_painted_finite
ascii, big-endian and truncated PLY, header counts of 1e18, plain point clouds and meshes named .ply
    drawn    test_files.py::test_every_encoding_and_degree_is_painted_alike
    refused  ../io/test_bad_files.py::test_a_binary_file_cut_off_says_how_many_rows_and_bytes
    refused  ../io/test_bad_files.py::test_an_ascii_file_cut_off_says_after_which_row
    refused  ../io/test_bad_files.py::test_an_absurd_count_is_refused_before_memory_is_allocated
    refused  ../io/test_bad_files.py::test_a_plain_point_cloud
    refused  ../io/test_bad_files.py::test_a_mesh
1 x 1 and 8192 x 8192 images
    drawn    test_sizes.py::test_a_picture_of_one_pixel_is_as_defined
    drawn    test_sizes.py::test_a_picture_of_8192_by_8192_has_its_strokes_where_they_belong
    drawn    test_sizes.py::test_strips_of_a_picture_are_the_picture
textures of 1 x 1, all transparent, 16 bit, grey, palette
    drawn    test_sizes.py::test_textures_of_every_kind_paint
    refused  test_sizes.py::test_a_texture_without_paint_is_refused_by_name_or_paints_nothing
"""


def _read(table: str) -> dict[str, list[tuple[str, str]]]:
    lines: dict[str, list[tuple[str, str]]] = {}
    for line in table.strip().splitlines():
        if line.startswith(" "):
            outcome, proof = line.split(maxsplit=1)
            lines[list(lines)[-1]].append((outcome, proof))
        else:
            lines[line] = []
    return lines


LIST = _read(_TABLE)  # line of the list -> (outcome, test or "scene: " and its name in `scenes.py`)
