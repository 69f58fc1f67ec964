"""The codes of findings: how severe each is, the action that settles it, and its meaning.

One code has one meaning for ever. A new one is an entry of `CODES`, a row of docs/findings.md and,
for its values, a row of docs/reports.md; the tests print the rows that are missing.
"""

from typing import Literal

__all__ = ["CODES", "Action", "Severity"]

Severity = Literal["info", "warning", "error"]

Action = Literal[
    "nothing",
    "look_at_frames",
    "place_markers",
    "correct_labels",
    "name_neutral",
    "name_nose_tip",
    "name_head_markers",
    "add_markers",
    "calibrate",
    "correct_pins",
    "name_expressions",
    "label_takes",
    "check_recording",
    "name_unit",
    "name_rate",
    "name_up_axis",
    "name_image_size",
    "make_shot_again",
    "correct_settings",
    "correct_rules",
    "correct_packages",
    "export_again",
    "correct_stage",
    "add_file",
    "keep_source",
    "process_again",
    "compare",
]
"""The remedy for a finding; docs/findings.md explains it for each code."""

CODES: dict[str, tuple[Severity, Action, str]] = {
    # takes
    "MARKER_OCCLUDED": ("info", "nothing", "a marker is occluded in some frames"),
    "MARKER_NEVER_SEEN": (
        "warning",
        "correct_labels",
        "a marker is occluded in every frame and is left out",
    ),
    "MARKER_WITHOUT_NEUTRAL": (
        "warning",
        "name_neutral",
        "a marker is occluded in all neutral frames and is left out",
    ),
    "MARKER_UNBOUND": (
        "info",
        "place_markers",
        "a marker of the take is bound to no vertex and is left out",
    ),
    "MARKER_BESIDE": (
        "info",
        "nothing",
        "markers sit a few millimetres off their bound vertices, as their rest and motion show",
    ),
    "MARKER_INACCURATE": (
        "info",
        "place_markers",
        "markers move unlike the face around them and get less weight",
    ),
    "BLINK_MOTION_REMOVED": (
        "info",
        "nothing",
        "landmarks of an image moved with the eyes in recorded blinks; that motion is taken off",
    ),
    "MARKER_UNKNOWN": (
        "warning",
        "correct_labels",
        "the binding names a marker that the take does not have",
    ),
    "MARKER_SWAPPED": (
        "warning",
        "look_at_frames",
        "labels of markers were swapped, and corrected",
    ),
    "MARKER_SPIKE": (
        "info",
        "nothing",
        "a marker jumped away from the face; taken as occluded there",
    ),
    "LID_DISBELIEVED": (
        "warning",
        "look_at_frames",
        "a lid's marker opens the eye further than a lid can; the motion of the other lid "
        "replaces it",
    ),
    "MARKER_FILLED": ("info", "look_at_frames", "a gap of a marker was filled in"),
    "CLEANUP_SKIPPED": ("info", "nothing", "too few frames or markers to clean the take up"),
    "LABEL_CHANGED": (
        "info",
        "nothing",
        "a marker label was shortened, or given where it was empty",
    ),
    "LABEL_REPEATED": (
        "warning",
        "correct_labels",
        "several markers have one label; all but the first got a number",
    ),
    "FRAMES_MISSING": (
        "warning",
        "check_recording",
        "the file announces more frames than it holds",
    ),
    "FRAMES_REPEATED": (
        "warning",
        "check_recording",
        "many frames repeat the one before them",
    ),
    "FRAMES_UNREAD": (
        "warning",
        "check_recording",
        "the file holds more frames than it announces; they are not read",
    ),
    "FRAMES_UNANNOUNCED": (
        "warning",
        "check_recording",
        "the file holds more frames than it announces; all are read",
    ),
    "MARKERS_MISCOUNTED": (
        "warning",
        "check_recording",
        "the file holds more or fewer markers than it announces; all are read",
    ),
    "FRAMES_UNNUMBERED": (
        "warning",
        "check_recording",
        "rows of faces have neither frame numbers nor times; time closes up where none was found",
    ),
    "FRAMES_DROPPED": (
        "info",
        "nothing",
        "frames are missing between recorded ones; times are kept",
    ),
    "FRAME_EMPTY": (
        "info",
        "nothing",
        "a frame without data was left out, or all its markers are occluded",
    ),
    "WEIGHT_BRIDGED": (
        "warning",
        "check_recording",
        "a weight is missing in a row with others; it is interpolated from the rows around it",
    ),
    "UNITS_ASSUMED": ("warning", "name_unit", "the file does not name its unit of length"),
    "TAKE_SIZE_UNUSUAL": (
        "warning",
        "name_unit",
        "the markers are spread too far apart, or too close together, for a face or a body",
    ),
    "DEFAULT_PRIM_CHOSEN": ("info", "nothing", "the stage has no defaultPrim; one was chosen"),
    "UP_AXIS_ASSUMED": ("info", "name_up_axis", "the file does not name its up axis"),
    "METRICS_MIXED": (
        "warning",
        "correct_stage",
        "a layer has another unit or up axis than its stage, which USD does not convert",
    ),
    "RATE_ASSUMED": ("warning", "name_rate", "the file does not name its frame rate"),
    "TIMECODE_ASSUMED": (
        "info",
        "nothing",
        "the file has no timecode; that of the take is the time of day of its first frame",
    ),
    "TIMES_IN_MILLISECONDS": (
        "warning",
        "nothing",
        "a file's times fit its rate as milliseconds, not as seconds",
    ),
    "RATE_CONTRADICTED": (
        "warning",
        "name_rate",
        "the frame rate that the file names contradicts its times; the times count",
    ),
    "RATE_UNUSUAL": ("warning", "name_rate", "the frame rate is unusual for a recording of a face"),
    "FRAMES_RENUMBERED": (
        "info",
        "nothing",
        "the first frame of the take is not the first one of the footage or the recording",
    ),
    "IMAGE_SIZE_UNKNOWN": (
        "info",
        "name_image_size",
        "the image's height is not known: y is counted from its lower edge",
    ),
    "REPROJECTION_ERROR": (
        "info",
        "nothing",
        "how far markers lie from the projections of their points in space",
    ),
    "VIEWS_DISAGREE": (
        "warning",
        "correct_labels",
        "cameras do not agree on where a marker is; it is taken as occluded there",
    ),
    "VIEWS_OUT_OF_STEP": (
        "warning",
        "correct_settings",
        "two cameras are out of sync: they agree better some frames earlier or later",
    ),
    "VIEW_SINGLE": ("info", "nothing", "a marker that only one camera sees is taken as occluded"),
    "CONFIDENCE_LOW": (
        "info",
        "nothing",
        "samples in which the tracking program has little confidence are taken as occluded",
    ),
    "CURVES_BY_UNIT": (
        "warning",
        "correct_settings",
        "recorded curves drive blend shapes of other names, of the same FACS action units",
    ),
    "CURVE_UNKNOWN": (
        "warning",
        "correct_labels",
        "the binding names a curve that the take does not have",
    ),
    "CHANNEL_IGNORED": ("info", "nothing", "a channel that usdface does not use was left out"),
    "FACES_JOINED": (
        "info",
        "check_recording",
        "a face that was lost and found again under another number is read as one",
    ),
    "FACES_LEFT_OUT": (
        "warning",
        "check_recording",
        "several faces were tracked; one of them is read",
    ),
    # films of painted dots
    "DOTS_FOUND": ("info", "nothing", "dots were found in the images, by their colour"),
    "DOTS_APART": (
        "warning",
        "check_recording",
        "dots form two groups far apart, as of two faces; they are tracked as one",
    ),
    "DOTS_IGNORED": ("info", "look_at_frames", "short-lived detections of dots are left out"),
    "DOTS_NAMED": (
        "info",
        "look_at_frames",
        "dots were named by matching the bound vertices of a character",
    ),
    "DOT_UNMATCHED": ("warning", "correct_labels", "a name or a correction matches no dot"),
    "IMAGE_UNREADABLE": (
        "warning",
        "check_recording",
        "an image cannot be read; all markers are occluded in its frame",
    ),
    "PIXELS_NOT_SQUARE": (
        "warning",
        "check_recording",
        "the images say that their pixels are not square; they are taken as square",
    ),
    "FOOTAGE_CUT": (
        "warning",
        "look_at_frames",
        "the footage has a cut; names after it were matched again by the layout of the dots",
    ),
    "TRACK_DOUBTED": (
        "warning",
        "look_at_frames",
        "the track of a marker may have switched to another dot",
    ),
    # formats of other packages
    "PLUGIN_FAILED": (
        "warning",
        "correct_packages",
        "a format of another package cannot be loaded",
    ),
    "PLUGIN_CONFLICT": ("warning", "correct_packages", "two packages claim files of one kind"),
    # hooks of other packages
    "HOOK_APPLIED": ("info", "nothing", "a hook of another package changed the data"),
    "HOOK_SKIPPED": ("info", "nothing", "a hook of another package was left out"),
    # bindings of other takes, shared layers
    "FRAMES_NOT_CARRIED": (
        "warning",
        "name_neutral",
        "neutral and peak frames of a binding belong to another take, and are detected again",
    ),
    "LAYER_KEPT": (
        "warning",
        "compare",
        "a layer that shots share is kept, although it differs from this shot's",
    ),
    "LAYER_RULES_DIFFER": (
        "warning",
        "compare",
        "a shot gets the rule base of the layer that it shares, which differs from its own",
    ),
    # sequences
    "PERFORMER_UNCALIBRATED": (
        "warning",
        "calibrate",
        "a performer of the show file has no calibration",
    ),
    "SHOT_FAILED": (
        "error",
        "correct_settings",
        "a shot of the sequence could not be made or processed",
    ),
    "SHOT_MISSING": (
        "error",
        "make_shot_again",
        "a shot of the sequence has no result, or one that is out of date",
    ),
    "SHOT_KEPT": (
        "warning",
        "compare",
        "a shot was edited, and is not made again from its sources",
    ),
    "SHOT_LEFT_OUT": (
        "info",
        "nothing",
        "a layer over a shot that has its result in itself is not processed as a shot",
    ),
    "CUT_TAKE_MISSING": (
        "warning",
        "correct_settings",
        "no take has the timecodes of a clip of the cut; it has no shot",
    ),
    "CUT_TAKE_AMBIGUOUS": (
        "warning",
        "correct_settings",
        "several takes have the timecodes of a clip of the cut; it has no shot",
    ),
    "CUT_EFFECT_IGNORED": (
        "warning",
        "correct_settings",
        "a clip of the cut has a speed change or an effect, which is left out",
    ),
    "CUT_BETWEEN_FRAMES": (
        "info",
        "nothing",
        "a clip of the cut begins between two frames of its deliverable, and is moved there",
    ),
    "RANGE_OUTSIDE": (
        "warning",
        "correct_settings",
        "frames of the range are not in the take, and are not written",
    ),
    # rigs
    # blend shapes, poses and peaks judged by action units
    "FACS_SHAPE_DEAD": (
        "warning",
        "export_again",
        "a blend shape moves too little to be seen on a face",
    ),
    "FACS_SIDE_OTHER": (
        "warning",
        "export_again",
        "a blend shape moves the side opposite to its name",
    ),
    "FACS_SHAPES_SWAPPED": (
        "warning",
        "export_again",
        "two blend shapes have each other's names",
    ),
    "FACS_UNIT_OTHER": (
        "warning",
        "export_again",
        "a blend shape does another action unit than its name says",
    ),
    "FACS_UNITS_MIXED": (
        "warning",
        "export_again",
        "a blend shape does the action unit of its name and another one",
    ),
    "FACS_UNIT_NOT_DONE": (
        "warning",
        "export_again",
        "a blend shape does not move the points of the action unit that its name says",
    ),
    "FACS_POSE_INCOMPLETE": (
        "info",
        "compare",
        "an action unit of an emotion cannot be seen in its expression pose",
    ),
    "FACS_UNIT_LOST": (
        "info",
        "look_at_frames",
        "an action unit is seen at the markers and not on the face",
    ),
    "FACS_NOT_JUDGED": (
        "warning",
        "nothing",
        "the face cannot be judged by action units",
    ),
    "SHAPES_ABSENT": ("info", "export_again", "a file has no mesh with blend shapes to check"),
    "SHAPE_EMPTY": ("info", "nothing", "a blend shape moves no point"),
    "SHAPE_SKIPPED": (
        "warning",
        "export_again",
        "a shape file is left out: it does not fit the neutral mesh, or lies in a folder below",
    ),
    "FACES_DIFFER": (
        "warning",
        "export_again",
        "a shape file has other faces; its points may be in another order",
    ),
    "SHAPE_TARGET_MISSING": (
        "error",
        "correct_stage",
        "a blend shape target does not exist or is inactive",
    ),
    "POINT_INDICES_UNSORTED": (
        "info",
        "nothing",
        "point indices are not sorted, which some programs require",
    ),
    "POINT_INDICES_REPEATED": (
        "warning",
        "export_again",
        "a point index is repeated; its offsets add up in UsdSkel",
    ),
    "POINT_INDICES_OUTSIDE": ("error", "export_again", "a point index is outside the mesh"),
    "POINT_STRAY": ("warning", "export_again", "a point lies, or is moved, far from all others"),
    "OFFSETS_LENGTH_WRONG": (
        "error",
        "export_again",
        "offsets, normals or indices of a shape differ in number",
    ),
    "SHAPE_NAMES_MISMATCH": (
        "error",
        "correct_stage",
        "names and targets of blend shapes differ in number",
    ),
    "SHAPE_NAME_REPEATED": (
        "warning",
        "correct_stage",
        "two blend shapes of a mesh share one name",
    ),
    "SHAPE_NAMES_MISSING": ("warning", "correct_stage", "morph targets have no names"),
    "SHAPE_NAMES_ASSUMED": (
        "info",
        "nothing",
        "morph targets without names were given those of their accessors, or numbers",
    ),
    "SHAPE_NAMES_AFFIXED": (
        "info",
        "nothing",
        "blend shapes are known by their names without a prefix or suffix that they share",
    ),
    "SHAPE_NAMES_COUNTED": (
        "warning",
        "make_shot_again",
        "an exporter made names of blend shapes unique by numbers, by which they are not known",
    ),
    "TARGETS_UNEQUAL": (
        "error",
        "export_again",
        "primitives of a mesh differ in their number of morph targets",
    ),
    "MESH_OUTSIDE": (
        "warning",
        "correct_stage",
        "a mesh is outside of every SkelRoot: it is kept, without its blend shapes, which UsdSkel "
        "does not move there",
    ),
    "TOPOLOGY_DIFFERS": ("error", "export_again", "faces and points do not belong together"),
    "NORMALS_MISSING": (
        "info",
        "nothing",
        "normals are missing or do not follow a shape; shading may differ",
    ),
    "BOUNDS_MISSING": (
        "warning",
        "export_again",
        "positions have no min and max, which glTF requires; viewers may refuse the file",
    ),
    "INBETWEEN_WRONG": (
        "error",
        "correct_stage",
        "an inbetween has no weight of its own between 0 and 1",
    ),
    "BINDING_TARGET_MISSING": (
        "error",
        "correct_stage",
        "a bound skeleton or animation does not exist or is inactive",
    ),
    "SKELROOT_MISSING": (
        "error",
        "correct_stage",
        "a mesh with blend shapes is below no SkelRoot; UsdSkel moves none of them",
    ),
    "SKELETON_MISSING": (
        "error",
        "correct_stage",
        "a mesh with blend shapes is bound to no skeleton; UsdSkel moves none of them",
    ),
    "SCHEMA_UNAPPLIED": (
        "error",
        "correct_stage",
        "SkelBindingAPI is not applied; UsdSkel ignores the binding",
    ),
    "ANIMATION_UNMATCHED": (
        "error",
        "correct_stage",
        "an animation names no blend shape of the meshes that it moves",
    ),
    "WEIGHTS_LENGTH_WRONG": (
        "error",
        "export_again",
        "the number of weights is not that of the blend shapes",
    ),
    "WEIGHTS_OUT_OF_RANGE": (
        "info",
        "nothing",
        "weights are outside 0 to 1, which is allowed but rarely intended",
    ),
    "VALUES_WRONG": ("error", "export_again", "numbers are missing, cut off, NaN or infinite"),
    "SHAPE_UNKNOWN": ("warning", "correct_settings", "a named blend shape is not on the rig"),
    "NAME_CHANGED": (
        "info",
        "nothing",
        "a name was made unique or legal, with the original kept beside it; or has its original "
        "again",
    ),
    "NAME_DROPPED": (
        "info",
        "nothing",
        "names of parts that the result has no place for are left out",
    ),
    "FACES_TRIANGULATED": ("info", "nothing", "faces with more than three corners were split"),
    "NORMALS_COMPUTED": ("info", "nothing", "the source has no normals; smooth ones were computed"),
    "NORMALS_FLAT": (
        "info",
        "nothing",
        "the source has no normals: faces are lit flat, as USD and glTF define",
    ),
    "TANGENTS_COMPUTED": (
        "info",
        "nothing",
        "tangent offsets of shapes were computed from their normal offsets",
    ),
    "INBETWEEN_DROPPED": (
        "warning",
        "keep_source",
        "an inbetween cannot be written to this format",
    ),
    "INBETWEEN_FLAT": (
        "info",
        "nothing",
        "inbetweens stay separate shapes: their weights were animated separately",
    ),
    "COMBINATION_IGNORED": (
        "warning",
        "correct_settings",
        "a combination shape is solved as an independent one",
    ),
    "FEATURE_DROPPED": (
        "warning",
        "keep_source",
        "the target format or this version does not support a feature",
    ),
    "HELPERS_DROPPED": (
        "info",
        "nothing",
        "helper faces of MakeHuman's base mesh, which clothes and joints are fitted to, are left "
        "out: they are no skin",
    ),
    "FEATURE_APPROXIMATED": (
        "warning",
        "compare",
        "the target format supports only an approximation of a feature",
    ),
    "EXTENSION_DROPPED": ("warning", "keep_source", "data of a glTF extension are left out"),
    "NODES_DROPPED": (
        "info",
        "nothing",
        "nodes that carry nothing of their own are left out: of a USD, and of a glTF beyond 8,192",
    ),
    "POINTS_ROUNDED": ("info", "nothing", "points are stored as 16-bit integers, as requested"),
    "TEXTURE_CONVERTED": (
        "info",
        "nothing",
        "a texture was converted to a format that glTF supports",
    ),
    "TEXTURE_TILED": ("info", "nothing", "each tile of a UDIM texture became a material"),
    "TEXTURE_MISSING": ("warning", "add_file", "a texture file cannot be read and is left out"),
    "ASSET_OUTSIDE": (
        "warning",
        "add_file",
        "a file outside the folder of the asset is left out; --asset-root DIR allows it",
    ),
    "INFLUENCES_MANY": (
        "warning",
        "export_again",
        "more than four joints influence a point; some programs read four",
    ),
    "GENERATION_MIXED": ("error", "process_again", "files of a result come from different runs"),
    "GLTF_OUTDATED": (
        "info",
        "process_again",
        "a glTF beside the result comes from an earlier run; process --gltf writes it again",
    ),
    "INFLUENCES_REDUCED": (
        "info",
        "nothing",
        "points keep their strongest joints only, as requested",
    ),
    "SKIN_WEIGHTS_NORMALISED": (
        "info",
        "nothing",
        "skin weights that did not add up to 1 were normalised, as glTF programs do",
    ),
    "PIVOTS_DROPPED": (
        "info",
        "nothing",
        "transforms of meshes are applied to their points; the pivots are not kept",
    ),
    "POINTS_TO_SHAPES": (
        "info",
        "nothing",
        "points that change over time became blend shapes",
    ),
    "CURVE_RESAMPLED": ("info", "nothing", "an animation curve was resampled"),
    "SCALE_ROUNDED": ("info", "nothing", "joint scales are stored as 16-bit floats in UsdSkel"),
    "ANIMATION_DROPPED": ("warning", "keep_source", "an animation was left out"),
    "ANIMATION_CREATED": (
        "info",
        "nothing",
        "the rig has no active SkelAnimation; the solve layer adds one",
    ),
    "CONVERSION_INEXACT": ("warning", "compare", "the written file differs from its source"),
    "CONVERSION_UNCERTIFIED": (
        "info",
        "compare",
        "the written file could not be compared with its source",
    ),
    "SPLINES_UNREAD": (
        "warning",
        "correct_packages",
        "this version of USD does not evaluate splines",
    ),
    # binding
    "MESH_ASSUMED": (
        "info",
        "place_markers",
        "the binding names vertices and no mesh, and several meshes have blend shapes: its "
        "vertices are those of the face",
    ),
    "BIND_PROPOSED": ("info", "place_markers", "the vertices of markers were proposed, not given"),
    "BIND_UNSURE": ("warning", "place_markers", "most proposed vertices have a low confidence"),
    "PLACE_DOUBTED": (
        "warning",
        "place_markers",
        "the given vertex of a marker contradicts the other markers",
    ),
    "PLACE_UNSURE": ("warning", "place_markers", "the proposed vertex of a marker may be wrong"),
    "PLACES_NOT_PROPOSED": (
        "warning",
        "place_markers",
        "no vertices could be proposed for the markers of a page",
    ),
    "NAME_CONTRADICTED": (
        "warning",
        "place_markers",
        "the position of a marker contradicts its name",
    ),
    "SIDES_EXCHANGED": (
        "warning",
        "correct_labels",
        "the names of the markers have left and right exchanged",
    ),
    "NAMES_UNUSED": (
        "warning",
        "nothing",
        "the names of the markers do not fit the face; places are proposed without them",
    ),
    "MARKER_OFF_FACE": ("warning", "nothing", "a marker is off the face and is left out"),
    "PLACE_UNKNOWN": (
        "info",
        "place_markers",
        "the name of an image's marker is no known place on a face; it is left out",
    ),
    "MARKER_DUPLICATE": (
        "warning",
        "correct_labels",
        "two markers are always at the same position; one is left out",
    ),
    "RIG_SIZE_UNUSUAL": (
        "warning",
        "name_unit",
        "the face is far larger or smaller than a human one",
    ),
    "CHARACTER_LYING": (
        "warning",
        "correct_stage",
        "the character looks up or down; its regions and features are those of an upright face",
    ),
    "CHARACTER_TURNED": (
        "info",
        "nothing",
        "the character looks to the side; it is solved as if it looked along +z",
    ),
    "NEUTRAL_KEPT": (
        "info",
        "name_neutral",
        "a take of weights does not rest in its least expressive frames, and no neutral is "
        "subtracted",
    ),
    "NEUTRAL_REMOVED": (
        "info",
        "name_neutral",
        "the weights of the neutral frames are subtracted from the whole take of weights",
    ),
    "NEUTRAL_FOUND": ("info", "look_at_frames", "neutral frames were detected"),
    # retarget
    "NEUTRAL_ASSUMED": (
        "warning",
        "name_neutral",
        "neutral frames are neither named nor detected; the first frame with markers is taken",
    ),
    "NEUTRAL_MOVES": (
        "info",
        "look_at_frames",
        "the face moves in some of the neutral frames, which are left out",
    ),
    "NEUTRAL_SHOWS": (
        "info",
        "look_at_frames",
        "the neutral frames show some blend shapes, which are subtracted from the neutral",
    ),
    "NEUTRAL_AT_LIMIT": (
        "warning",
        "name_neutral",
        "the neutral frames show an expression that is larger than the part that is subtracted",
    ),
    "NOSE_TIP_ASSUMED": (
        "warning",
        "name_nose_tip",
        "no marker is named as the nose tip; the foremost is taken",
    ),
    "MESHES_UNDRIVEN": (
        "warning",
        "correct_stage",
        "other meshes have the face's blend shapes, and another SkelAnimation or none",
    ),
    "SHAPES_FOLLOW": (
        "info",
        "nothing",
        "blend shapes of other meshes have the face's names behind another node's, or before a "
        "number of an exporter's, and follow it",
    ),
    "MESHES_LEFT_BEHIND": (
        "warning",
        "correct_stage",
        "meshes of the face do not follow the motion of the head",
    ),
    "HEAD_MARKERS_FEW": (
        "warning",
        "name_head_markers",
        "fewer than three head markers, or only some in a line, are visible in some frames",
    ),
    "GAZE_BY_JOINTS": (
        "info",
        "correct_settings",
        "the recorded gaze turns the eye joints of the character",
    ),
    "GAZE_RECORDED": (
        "info",
        "correct_settings",
        "the recorded gaze of the take is used, relative to the neutral frames",
    ),
    "GAZE_UNSHOWN": (
        "info",
        "correct_settings",
        "the recorded gaze is not shown: the rig has no blend shapes of gaze and no joints of eyes",
    ),
    "HEAD_LEFT_STILL": (
        "warning",
        "correct_settings",
        "the recorded motion of the head is left out: no joint turns the head of this body alone",
    ),
    "HEAD_PIVOT_ASSUMED": (
        "info",
        "correct_settings",
        "no joint carries the face; the head turns as recorded about the middle of the head",
    ),
    "HEAD_TURNED_AT_NEUTRAL": (
        "info",
        "name_neutral",
        "the head is turned in the neutral frames, from which the character's motion is measured",
    ),
    "HEAD_MARKERS_IN_LINE": (
        "warning",
        "name_head_markers",
        "the head markers are collinear and leave a rotation open; all markers determine it",
    ),
    "MARKERS_FEW": ("warning", "add_markers", "the markers cannot distinguish all blend shapes"),
    "TAKE_SAMPLED": (
        "info",
        "nothing",
        "neutral, places, map and covariance of a long take come from a sample of its frames",
    ),
    "FOCAL_LENGTH_FOUND": ("info", "nothing", "the head's motion shows the focal length"),
    "FOCAL_LENGTH_ASSUMED": (
        "info",
        "nothing",
        "the take does not show the focal length; a usual one is taken",
    ),
    "FOCAL_LENGTH_UNUSUAL": (
        "warning",
        "check_recording",
        "no lens has the field of view that the focal length gives; it may be in millimetres",
    ),
    "HEAD_IN_PLANE": (
        "warning",
        "add_markers",
        "too few markers of an image for the head's pose before the camera; it moves in its plane",
    ),
    "IMAGE_SIZE_ASSUMED": (
        "warning",
        "name_image_size",
        "the size of the image is unknown; the camera is taken to look at the face",
    ),
    "TAKE_STILL": ("warning", "check_recording", "no marker moves in the whole take"),
    "WEIGHTS_CLIPPED": ("warning", "nothing", "recorded weights outside 0 to 1 were clipped"),
    "WEIGHTS_OVERSHOT": (
        "info",
        "nothing",
        "recorded weights outside 0 to 1 by a hundredth at most, as of recorders, were clipped",
    ),
    "FRAME_UNSOLVED": (
        "warning",
        "look_at_frames",
        "frames without markers, or with too few for the head's pose, follow their neighbours",
    ),
    "SOLVE_UNCOMPILED": (
        "info",
        "correct_packages",
        "the inner loops of the solve run in numpy, several times slower",
    ),
    "SHAPE_UNSEEN": ("info", "add_markers", "a blend shape moves no bound marker and stays at 0"),
    "SHAPE_UNDETERMINED": (
        "info",
        "add_markers",
        "the markers hardly determine a blend shape; one more may",
    ),
    "PIN_IGNORED": (
        "warning",
        "correct_pins",
        "a pin has an unknown blend shape, a frame outside the take or a weight outside 0 to 1",
    ),
    "REGION_MUTED": (
        "warning",
        "place_markers",
        "a region of the character moves less than the performer's, or than the exaggeration "
        "asks for",
    ),
    "DIRECTION_UNKNOWN": (
        "info",
        "calibrate",
        "the calibration take does not show how the performer makes a blend shape",
    ),
    "CALIBRATION_UNUSED": (
        "info",
        "nothing",
        "a performer's file says nothing of a take of weights: it is of markers",
    ),
    "PERFORMER_UNMATCHED": (
        "warning",
        "calibrate",
        "the performer's file does not know markers as they are bound; there the shapes are the "
        "character's",
    ),
    "PERFORMER_OTHER": (
        "warning",
        "calibrate",
        "the take's face differs from that of the performer's file as another person's does",
    ),
    "PERFORMER_SHAPES_UNUSED": (
        "info",
        "calibrate",
        "the performer's file explains how the markers move worse than the proportions of the "
        "face do: its places and gains are used, its shapes are not",
    ),
    "PERFORMER_MARKERS_MOVED": (
        "info",
        "nothing",
        "markers sit elsewhere than in the take that the performer's file was made of",
    ),
    "GAIN_FOUND": (
        "info",
        "calibrate",
        "movements exceed the character's blend shapes; their gains are estimated from the take",
    ),
    "BROWS_RESTORED": (
        "info",
        "nothing",
        "the solve made the brows too small, as the blend shapes explain their motion badly; they "
        "were scaled up",
    ),
    "GAIN_UNSEEN": (
        "info",
        "calibrate",
        "a blend shape never moves in the calibration take; its gain stays about 1",
    ),
    "GAIN_UNKNOWN": (
        "info",
        "calibrate",
        "the calibration take leaves a gain undetermined: small movement and low gain look alike",
    ),
    # expressions
    "EXPRESSION_UNKNOWN": (
        "warning",
        "name_expressions",
        "the rig has no shapes for an expression",
    ),
    "EXPRESSION_UNSEEN": (
        "warning",
        "add_markers",
        "the markers cannot distinguish an expression from the others",
    ),
    "EXPRESSION_HELD_BACK": (
        "info",
        "look_at_frames",
        "a detected emotion is not raised, because a region does not show its pose",
    ),
    "EXPRESSION_SHARED": (
        "info",
        "nothing",
        "the features of one expression respond a little to another",
    ),
    "MARKERS_CANNOT_SEPARATE": (
        "warning",
        "add_markers",
        "no marker motion distinguishes two emotions",
    ),
    "FIT_CONFUSED": ("warning", "label_takes", "a fitted system confuses an emotion with another"),
    "FIT_UNTESTED": (
        "info",
        "label_takes",
        "an emotion was learned from one recording and could not be tested",
    ),
    "RULE_FIRES_AT_NEUTRAL": ("warning", "correct_rules", "a rule fires on a neutral face"),
    "ATTRIBUTE_REPLACED": (
        "warning",
        "correct_settings",
        "an attribute of another type is replaced by the result",
    ),
    "RESULT_ABSENT": (
        "warning",
        "process_again",
        "a shot was not processed: its take does not move the face",
    ),
    "EDIT_HIDDEN": (
        "warning",
        "correct_stage",
        "a layer edits an earlier result, and the new result lies over it",
    ),
    "RESULT_HIDDEN": (
        "warning",
        "correct_stage",
        "a stronger layer of the stage overrides values of the result",
    ),
    "SETTING_UNREAD": (
        "warning",
        "correct_settings",
        "a setting, a curve or an override is ignored",
    ),
    "RULE_UNREACHABLE": ("warning", "correct_rules", "a rule can never fire"),
    "OUTPUT_WITHOUT_RULE": (
        "info",
        "correct_rules",
        "no rule concludes an output, so it keeps its default: with 0 its emotion is never raised",
    ),
    "RULE_OFF": ("info", "nothing", "a rule is disabled or has weight 0"),
    "RULES_CONTRADICT": (
        "warning",
        "correct_rules",
        "two rules have the same antecedent and different consequents",
    ),
    "RANGE_UNCOVERED": ("warning", "correct_rules", "no term covers a part of an input's range"),
    "TERM_FAR": (
        "warning",
        "correct_rules",
        "no motion of a face reaches a term; it may be in another unit than the system's",
    ),
    "ROLE_ASSUMED": (
        "info",
        "correct_rules",
        "the file names no marker for an input; the input's name was taken",
    ),
    "MEANING_DIFFERS": (
        "warning",
        "correct_rules",
        "another program evaluates the file differently",
    ),
    "CONTACT_KEPT": ("info", "nothing", "a correction was limited to keep lips or lids in contact"),
    # closure
    "EYES_CLOSED": ("info", "nothing", "eyes that blink or stay shut were closed on the character"),
    "BLINK_DOUBTED": (
        "info",
        "look_at_frames",
        "blink-like pulses that do not close the eyes were left as solved",
    ),
    "BLINK_GUESSED": (
        "warning",
        "look_at_frames",
        "a blink was seen on one eye only and given to both",
    ),
    "BLINK_RECORDED": (
        "info",
        "look_at_frames",
        "blinks that the recording names, but its markers do not show, were closed",
    ),
    "LIDS_UNSEEN": (
        "info",
        "add_markers",
        "no marker shows the lids of an eye; its blinks are not completed",
    ),
    "LIDS_NOT_FOUND": (
        "info",
        "look_at_frames",
        "no lids that meet were found on the mesh; blinks are not completed",
    ),
    "LIDS_GUESSED": (
        "info",
        "look_at_frames",
        "the rig's closed lids move the markers unlike a person's; blinks are detected by the lid "
        "motion of a scanned face",
    ),
    "LIDS_CROSS": ("warning", "correct_pins", "pinned weights make the lids of an eye cross"),
    "EYE_OPENED": (
        "info",
        "look_at_frames",
        "the solve narrowed one eye more than its markers show; it was opened",
    ),
    "LIDS_PARTED": (
        "info",
        "look_at_frames",
        "shut lids that crossed were parted; they stay open in part, or the lower lid is lowered",
    ),
    "LIPS_CLOSED": ("info", "nothing", "lips that touch on the performer were brought together"),
    "LIPS_APART": (
        "info",
        "look_at_frames",
        "lips that touch on the performer stay open: no weights were found that close them",
    ),
    "LIPS_UNSEEN": (
        "info",
        "add_markers",
        "no markers show the contact of the lips; it is not completed",
    ),
    "EXPRESS_SKIPPED": (
        "warning",
        "make_shot_again",
        "the shot has no fuzzy system; no express layer is written",
    ),
    # every job
    "FILE_UNREADABLE": (
        "error",
        "export_again",
        "a file is missing, may not be read, or is of another kind",
    ),
    "ADVICE_FAILED": (
        "info",
        "nothing",
        "advice could not be given; the result does not depend on it",
    ),
    "CACHE_NOT_KEPT": (
        "info",
        "nothing",
        "a stage could not be kept in the cache, and is computed again by the next run",
    ),
}
