"""Names that other marker sets would give to AnimFace's 41 markers, and takes renamed so.

`vicon`: capitals with a subject; `camel`: as face bones; `german`, `italian`: words; `numbered`:
part, side and a number only. `anonymous` and `exchanged` (left for right) are made of AnimFace's.
"""

from dataclasses import replace

from usdface.takes import MarkerTake

__all__ = ["MARKER_SETS", "renamed"]

_COLUMNS = ("animface", "vicon", "camel", "german", "italian", "numbered")
_TABLE = """
ForeHead_M actor:FH2 foreheadMid Stirn_Mitte fronte_centro Forehead_1
ForeHead_L actor:FH1 lForehead Stirn_links fronte_sx ForeheadL_1
ForeHead_R actor:FH3 rForehead Stirn_rechts fronte_dx ForeheadR_1
Leyebrow_M actor:LBRO2 lBrowMid Augenbraue_Mitte_links sopracciglio_centro_sx Leyebrow_1
Leyebrow_Inside actor:LBRO1 lBrowInner Augenbraue_innen_links sopracciglio_interno_sx Leyebrow_2
Leyebrow_Outside actor:LBRO3 lBrowOuter Augenbraue_außen_links sopracciglio_esterno_sx Leyebrow_3
Eyebrow_Center actor:MBRO midBrow Nasenwurzel_oben radice_naso_alta Eyebrow_1
Reyebrow_M actor:RBRO2 rBrowMid Augenbraue_Mitte_rechts sopracciglio_centro_dx Reyebrow_1
Reyebrow_Inside actor:RBRO1 rBrowInner Augenbraue_innen_rechts sopracciglio_interno_dx Reyebrow_2
Reyebrow_Outside actor:RBRO3 rBrowOuter Augenbraue_außen_rechts sopracciglio_esterno_dx Reyebrow_3
NoseTop actor:MNOSE noseBridge Nasenrücken dorso_naso Nose_1
NoseHead actor:TNOSE noseTip Nasenspitze punta_naso Nose_2
NoseHead_L actor:LNSTRL lNostril Nasenflügel_links narice_sx NoseL_1
NoseHead_R actor:RNSTRL rNostril Nasenflügel_rechts narice_dx NoseR_1
Leye_Up actor:LULID lEyelidUpper Oberlid_links palpebra_superiore_sx Leye_1
Leye_Down actor:LLLID lEyelidLower Unterlid_links palpebra_inferiore_sx Leye_2
Leye_Inside actor:LEYEIN lEyeInner Augenwinkel_innen_links angolo_occhio_interno_sx Leye_3
Leye_Outside actor:LEYEOUT lEyeOuter Augenwinkel_außen_links angolo_occhio_esterno_sx Leye_4
Reye_Up actor:RULID rEyelidUpper Oberlid_rechts palpebra_superiore_dx Reye_1
Reye_Down actor:RLLID rEyelidLower Unterlid_rechts palpebra_inferiore_dx Reye_2
Reye_Inside actor:REYEIN rEyeInner Augenwinkel_innen_rechts angolo_occhio_interno_dx Reye_3
Reye_Outside actor:REYEOUT rEyeOuter Augenwinkel_außen_rechts angolo_occhio_esterno_dx Reye_4
Lcheek_Up actor:LCHK1 lCheekUpper Wange_oben_links guancia_superiore_sx Lcheek_1
Lcheek_Down actor:LCHK2 lCheekLower Wange_unten_links guancia_inferiore_sx Lcheek_2
Lcheek_Outside actor:LCHK3 lCheekOuter Wange_außen_links guancia_esterno_sx Lcheek_3
Rcheek_up actor:RCHK1 rCheekUpper Wange_oben_rechts guancia_superiore_dx Rcheek_1
Rcheek_Down actor:RCHK2 rCheekLower Wange_unten_rechts guancia_inferiore_dx Rcheek_2
Rcheek_Outside actor:RCHK3 rCheekOuter Wange_außen_rechts guancia_esterno_dx Rcheek_3
Mouth_Up actor:ULIP upperLip Oberlippe_Mitte labbro_superiore_centro Mouth_1
Mouth_Down actor:LLIP lowerLip Unterlippe_Mitte labbro_inferiore_centro Mouth_2
Mouth_UpL1 actor:LULIP lLipUpperOuter Oberlippe_links labbro_superiore_sx MouthL_1
Mouth_Lend actor:LMC lLipCorner Mundwinkel_links commissura_bocca_sx MouthL_2
Mouth_UpR1 actor:RULIP rLipUpperOuter Oberlippe_rechts labbro_superiore_dx MouthR_1
Mouth_Rend actor:RMC rLipCorner Mundwinkel_rechts commissura_bocca_dx MouthR_2
Mouth_DownL actor:LLLIP lLipLowerOuter Unterlippe_links labbro_inferiore_sx MouthL_3
Mouth_DownR actor:RLLIP rLipLowerOuter Unterlippe_rechts labbro_inferiore_dx MouthR_3
Chin actor:CHIN chin Kinn mento Chin_1
Chin_R1 actor:RJAW1 rChinSide Kiefer_rechts_1 mascella_dx_1 ChinR_1
Chin_R2 actor:RJAW2 rJaw Kiefer_rechts_2 mascella_dx_2 ChinR_2
Chin_L1 actor:LJAW1 lChinSide Kiefer_links_1 mascella_sx_1 ChinL_1
Chin_L2 actor:LJAW2 lJaw Kiefer_links_2 mascella_sx_2 ChinL_2
"""
MARKER_SETS = (*_COLUMNS, "anonymous", "exchanged")


def _tables() -> dict[str, dict[str, str]]:
    rows = [line.split() for line in _TABLE.strip().splitlines()]
    sets = {column: {row[0]: row[i] for row in rows} for i, column in enumerate(_COLUMNS)}
    sets["anonymous"] = {row[0]: f"m{i}" for i, row in enumerate(rows)}
    other = {row[2]: row[0] for row in rows}  # by camel case: l... and r...
    sets["exchanged"] = {
        row[0]: other.get({"l": "r", "r": "l"}.get(row[2][0], "") + row[2][1:], row[0])
        for row in rows
    }
    return sets


_SETS = _tables()


def renamed(take: MarkerTake, marker_set: str) -> MarkerTake:
    """Return AnimFace's take with the names of another set."""
    names = _SETS[marker_set]
    return replace(take, names=tuple(names[name] for name in take.names))
