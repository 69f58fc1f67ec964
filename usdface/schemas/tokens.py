"""Names of the prim types and attributes of the usdface schemas, in schema order.

Plain strings, so that they load nothing and can be handed to any USD call. A test holds
them equal to `schema.usda`.
"""

from typing import Final

# Prim types
MARKER_TAKE: Final = "UsdFaceMarkerTake"
RETARGET: Final = "UsdFaceRetarget"
EXPRESSION: Final = "UsdFaceExpression"
FUZZY_SYSTEM: Final = "UsdFaceFuzzySystem"
FUZZY_VARIABLE: Final = "UsdFaceFuzzyVariable"
FUZZY_RULE: Final = "UsdFaceFuzzyRule"

# Fallback type of a prim for a reader without the schemas
FALLBACK_TYPES: Final[dict[str, str]] = {
    MARKER_TAKE: "Points",
    RETARGET: "Scope",
    EXPRESSION: "Scope",
    FUZZY_SYSTEM: "Scope",
    FUZZY_VARIABLE: "Scope",
    FUZZY_RULE: "Scope",
}

# UsdFaceMarkerTake
POINTS: Final = "points"
MARKERS_NAMES: Final = "usdface:markers:names"
MARKERS_VISIBLE: Final = "usdface:markers:visible"
BLINK: Final = "usdface:blink"
GAZE: Final = "usdface:gaze"
MARKERS_DEVIATION: Final = "usdface:markers:deviation"
MARKERS_DIAMETERS: Final = "usdface:markers:diameters"
DIMENSION: Final = "usdface:dimension"
IMAGE_SIZE: Final = "usdface:imageSize"
FOCAL_LENGTH: Final = "usdface:focalLength"
FIRST_FRAME: Final = "usdface:firstFrame"
SOURCE: Final = "usdface:source"
SOURCE_RATE: Final = "usdface:sourceRate"
START_TIMECODE: Final = "usdface:startTimecode"

# UsdFaceRetarget: relationships
TAKE: Final = "usdface:take"
RIG: Final = "usdface:rig"
SYSTEM: Final = "usdface:fuzzySystem"
EXPRESSIONS: Final = "usdface:expressions"
BIND_MESH: Final = "usdface:bind:mesh"

# UsdFaceRetarget: attributes
BIND_MARKERS: Final = "usdface:bind:markers"
BIND_POINTS: Final = "usdface:bind:points"
BIND_CONFIDENCE: Final = "usdface:bind:confidence"
BIND_UNSURE_MARKERS: Final = "usdface:bind:unsure:markers"
BIND_UNSURE_POINTS: Final = "usdface:bind:unsure:points"
BIND_UNSURE_CONFIDENCE: Final = "usdface:bind:unsure:confidence"
HEAD_MODE: Final = "usdface:head:mode"
HEAD_APPLY: Final = "usdface:head:apply"
HEAD_JOINT: Final = "usdface:head:joint"
EYE_JOINTS: Final = "usdface:eyes:joints"
EYE_TURN: Final = "usdface:eyes:turn"
HEAD_MARKERS: Final = "usdface:head:markers"
NOSE_TIP: Final = "usdface:noseTip"
ROLES_NAMES: Final = "usdface:roles:names"
ROLES_MARKERS: Final = "usdface:roles:markers"
NEUTRAL_MODE: Final = "usdface:neutral:mode"
NEUTRAL_RANGE: Final = "usdface:neutral:range"
NEUTRAL_REMOVED: Final = "usdface:neutral:removed"
NEUTRAL_SHAPES: Final = "usdface:neutral:shapes"
NEUTRAL_WEIGHTS: Final = "usdface:neutral:weights"
CURVES_NAMES: Final = "usdface:curves:names"
CURVES_SHAPES: Final = "usdface:curves:shapes"
CURVES_FACTORS: Final = "usdface:curves:factors"
PEAKS: Final = "usdface:peaks"
MAP_KERNEL: Final = "usdface:map:kernel"
MAP_FORM: Final = "usdface:map:form"
MAP_CHOICE: Final = "usdface:map:choice"
MAP_RADIUS: Final = "usdface:map:radius"
MAP_SMOOTHING: Final = "usdface:map:smoothing"
SOLVE_PREFIX: Final = "usdface:solve:"  # then a name of usdface.options.solve_settings
CALIBRATION_SHAPES: Final = "usdface:calibration:shapes"
CALIBRATION_GAINS: Final = "usdface:calibration:gains"
CALIBRATION_OFFSETS: Final = "usdface:calibration:offsets"
CALIBRATION_MARKERS: Final = "usdface:calibration:markers"
CALIBRATION_POINTS: Final = "usdface:calibration:points"
CALIBRATION_SHIFTS: Final = "usdface:calibration:shifts"
CALIBRATION_REST: Final = "usdface:calibration:rest"
CALIBRATION_FRAMES: Final = "usdface:calibration:frames"
CALIBRATION_MOVEMENTS: Final = "usdface:calibration:movements"
CALIBRATION_DISPLACEMENTS: Final = "usdface:calibration:displacements"
EXAGGERATION: Final = "usdface:exaggeration"
BROWS_EXAGGERATION: Final = "usdface:brows:exaggeration"
EYES_EXAGGERATION: Final = "usdface:eyes:exaggeration"
MOUTH_EXAGGERATION: Final = "usdface:mouth:exaggeration"
CLEAN_BLINKS: Final = "usdface:clean:blinks"
CLEAN_SWAPS: Final = "usdface:clean:swaps"
CLEAN_SPIKES: Final = "usdface:clean:spikes"
CLEAN_GAPS: Final = "usdface:clean:gaps"
CLOSURE_LIDS: Final = "usdface:closure:lids"
CLOSURE_LIPS: Final = "usdface:closure:lips"
CLOSURE_LEFT_EYE: Final = "usdface:closure:leftEye"
CLOSURE_RIGHT_EYE: Final = "usdface:closure:rightEye"
CLOSURE_MOUTH: Final = "usdface:closure:mouth"
CLEAN_REPAIRS_MARKERS: Final = "usdface:clean:repairs:markers"
CLEAN_REPAIRS_FRAMES: Final = "usdface:clean:repairs:frames"
CLEAN_REPAIRS_KINDS: Final = "usdface:clean:repairs:kinds"
HEAD_ROTATION: Final = "usdface:head:rotation"
HEAD_TRANSFORM: Final = "usdface:head:transform"
RESIDUAL: Final = "usdface:residual"
# Followed by the name of a region: usdface:residual:mouth
RESIDUAL_PREFIX: Final = "usdface:residual:"
# Followed by the name of a blend shape: usdface:pin:jawOpen
PIN_PREFIX: Final = "usdface:pin:"
FEATURE_POINTS: Final = "usdface:featurePoints"
SOLVED_MARKERS: Final = "usdface:solved:markers"
SOLVED_DISTANCES: Final = "usdface:solved:distances"
SOLVED_SHAPES: Final = "usdface:solved:shapes"
SOLVED_DEVIATIONS: Final = "usdface:solved:deviations"
VERDICT: Final = "usdface:verdict"

# UsdFaceRetarget: parts of the face
LEFT_SHAPES: Final = "usdface:left:shapes"
RIGHT_SHAPES: Final = "usdface:right:shapes"
BROWS_SHAPES: Final = "usdface:brows:shapes"
EYES_SHAPES: Final = "usdface:eyes:shapes"
MOUTH_SHAPES: Final = "usdface:mouth:shapes"
ANTAGONISTS: Final = "usdface:antagonists"
CONTACT_LIPS: Final = "usdface:contact:lips"
CONTACT_LIDS: Final = "usdface:contact:lids"
CONTACT_TOLERANCE: Final = "usdface:contact:tolerance"

# UsdFaceExpression (its gain is GAIN)
SHAPES: Final = "usdface:shapes"
WEIGHTS: Final = "usdface:weights"

# UsdFaceExpression and UsdFaceFuzzySystem
GAIN: Final = "usdface:gain"

# UsdFaceFuzzySystem
RESPONSE: Final = "usdface:response"
FEATURE_SMOOTHING: Final = "usdface:smoothing"
BLEND_TIME: Final = "usdface:blendTime"
EASE: Final = "usdface:ease"
EVIDENCE: Final = "usdface:evidence"
LIKENESS: Final = "usdface:likeness"
BROWS_GAIN: Final = "usdface:brows:gain"
EYES_GAIN: Final = "usdface:eyes:gain"
MOUTH_GAIN: Final = "usdface:mouth:gain"
NORMALISATION: Final = "usdface:normalisation"
AND: Final = "usdface:and"
SPACE: Final = "usdface:space"
FACE_UNIT: Final = "usdface:faceUnit"
NEUTRAL_RULE: Final = "usdface:neutralRule"
MODE: Final = "usdface:mode"
INFERENCE: Final = "usdface:inference"
OR: Final = "usdface:or"
IMPLICATION: Final = "usdface:implication"
AGGREGATION: Final = "usdface:aggregation"
DEFUZZIFIER: Final = "usdface:defuzzifier"
SAMPLES: Final = "usdface:samples"
SAMPLING: Final = "usdface:sampling"
FIRING: Final = "usdface:firing"
INPUTS: Final = "usdface:inputs"
INPUTS_UNIT: Final = "usdface:inputs:unit"
# Followed by the name of an output: usdface:emotion:joy
EMOTION_PREFIX: Final = "usdface:emotion:"

# UsdFaceFuzzyVariable
VARIABLE_KIND: Final = "usdface:kind"
VARIABLE_ROLE: Final = "usdface:role"
VARIABLE_AXIS: Final = "usdface:axis"
VARIABLE_MEASURE: Final = "usdface:measure"
TERMS_NAMES: Final = "usdface:terms:names"
TERMS_KINDS: Final = "usdface:terms:kinds"
TERMS_PARAMETERS: Final = "usdface:terms:parameters"
TERMS_COUNTS: Final = "usdface:terms:counts"
VARIABLE_RANGE: Final = "usdface:range"
VARIABLE_DEFAULT: Final = "usdface:default"

# UsdFaceFuzzyRule
RULE_TEXT: Final = "usdface:text"
RULE_WEIGHT: Final = "usdface:weight"
ENABLED: Final = "usdface:enabled"

__all__ = sorted(name for name in globals() if name.isupper())
