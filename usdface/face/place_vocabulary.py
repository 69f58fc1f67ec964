"""Words for places on a face, as data: add a word to the text of its concept.

Lower case, accents left out (é = e, ü = u or ue). Languages besides English: German, French,
Spanish, Italian, Portuguese, Japanese in Latin letters. Abbreviations are those of marker sets and
face rigs in use: AnimFace, MotionBuilder's actor face, IEMOCAP's Vicon set, Stasm and Multi-PIE
landmarks, Daz and Biped face bones, MediaPipe-based rigs, Vicon's head markers.
"""

from collections.abc import Mapping
from types import MappingProxyType

__all__ = [
    "AMBIGUOUS",
    "IGNORED",
    "IMPLIED",
    "LETTERS",
    "LETTERS_OF_A_SIDE",
    "PARTS",
    "TWOFOLD",
    "WORDS",
]

# Parts of a face, the more specific first: an eyebrow is a brow, an eyelid a lid.
PARTS = (
    *("nostril", "philtrum", "nasolabial", "brow", "lid", "cheekbone", "temple", "forehead"),
    *("cheek", "chin", "jaw", "ear", "lip", "nose", "eye", "mouth"),
)

_TEXT = {
    # parts
    "forehead": "forehead fore frontalis fh fhd fhead frhd stirn fronte frente hitai odeko",
    "brow": "brow brows eyebrow ebrow ebr brw bro corrugator braue augenbraue sourcil ceja "
    "cejas sopracciglio sopracciglia sobrancelha mayu mayuge",
    "lid": "lid lids eyelid elid augenlid paupiere parpado palpebra mabuta",
    "eye": "eye eyes auge augen oeil yeux ojo occhio olho canthus exocanthion endocanthion orbit",
    "nose": "nose nase nasen nasal nez nariz naso hana nas",
    "nostril": "nostril nostrils nstrl nostr naris nares ala alar alare alae wing nasenflugel "
    "nasenfluegel narine aile narice narina kobana",
    "philtrum": "philtrum filtrum",
    "nasolabial": "nasolabial levator smileline laughline",
    "cheek": "cheek cheeks chk chek malar puffer wange backe joue mejilla guancia bochecha hoho",
    "cheekbone": "cheekbone zygoma zygomatic zygion zyg jochbein pommette pomulo zigomo",
    "lip": "lip lips labium lippe levre labio labbro labbra kuchibiru",
    "mouth": "mouth mth mou mund bouche boca bocca kuchi commissure comisura commissura "
    "comissura cheilion kokaku stomion",
    "chin": "chin kinn menton mento mentum mentalis barbilla queixo gnathion pogonion ago",
    "jaw": "jaw jawline mandible mandibula mandibule mandibola kiefer unterkiefer machoire "
    "mascella quijada maxilar gonion masseter",
    "temple": "temple temporal tmpl schlafe schlaefe tempe sien tempia tempora komekami",
    "ear": "ear tragus ohr oreille oreja orecchio orelha mimi",
    # not on the face's skin; without another part they tell no place
    "head": "head hd kopf tete cabeza testa cabeca atama",
    # sides, the performer's
    "left": "left lft lt links linke linker linkes gauche izquierdo izquierda izq esquerdo "
    "esquerda sinistro sinistra sx hidari",
    "right": "right rgt rt rechts rechte rechter rechtes droit droite derecho derecha direito "
    "direita destro destra dx migi",
    "middle": "middle mid md mdl center centre central ctr cen median mitte mittig mittlere "
    "milieu centro medio media mezzo meio naka glabella philtrum columella menton pogonion",
    # directions
    "upper": "upper up upr uppr top above over high superior superius sup raise oben ober "
    "obere haut superieur superieure arriba alto superiore cima ue",
    "lower": "lower low lo lwr lw down dn bottom bot btm below under inferior inferius inf "
    "unten unter untere bas inferieur inferieure abajo bajo inferiore baixo shita",
    "inner": "inner inn inside inr in int medial med innen innere innerer interieur interne "
    "interno interna interior uchi endocanthion corrugator",
    "outer": "outer out outside otr external ext lateral lat tail back rear aussen aussere "
    "ausserer exterieur externe externo externa esterno esterna exterior soto exocanthion",
    "corner": "corner crnr cnr crn corn winkel ecke coin commissure comisura comissura "
    "commissura esquina angolo canto cheilion kokaku kado canthus exocanthion endocanthion angle",
    "end": "end",
    "tip": "tip apex pronasale spitze pointe bout punta ponta",
    "bridge": "bridge nasion sellion dorsum root radix ridge rucken ruecken wurzel racine "
    "arete puente radice ponte",
    "base": "base columella subnasale",
    "front": "front",
}

# Words of more than one concept that their parts would not tell.
_COMPOUNDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "mc": ("mouth", "corner"),
        "ulip": ("upper", "lip"),
        "llip": ("lower", "lip"),  # behind a side
        "glabella": ("brow", "middle"),
        "nasion": ("nose", "bridge"),
        "sellion": ("nose", "bridge"),
        "subnasale": ("nose", "base"),
        "columella": ("nose", "base"),
        "pronasale": ("nose", "tip"),
        "tnose": ("nose", "tip"),
    }
)

# Letters at the start or the end of a word: "LBrow", "browL", "MULip".
LETTERS: Mapping[str, str] = MappingProxyType(
    {"l": "left", "r": "right", "u": "upper", "m": "middle", "c": "middle"}
)

# Letters behind that of a side: "LOBRO", "RLLID".
LETTERS_OF_A_SIDE: Mapping[str, str] = MappingProxyType(
    {
        "o": "outer",
        "i": "inner",
        "u": "upper",
        "l": "lower",
        "m": "middle",
        "c": "middle",
    }
)

# Short labels that mean a part only where the name has no other, with a side or a number: "LC1",
# "CH2" of IEMOCAP, "front_gauche". Of one letter only with a side: C7 is a vertebra.
AMBIGUOUS: Mapping[str, str] = MappingProxyType({"c": "cheek", "ch": "chin", "front": "forehead"})

# Parts that a direction implies where the name has no part.
IMPLIED: Mapping[str, str] = MappingProxyType({"bridge": "nose", "corner": "mouth"})

# Labels that are read in two ways, and the concepts common to both: the left or the lower lip.
TWOFOLD: Mapping[str, tuple[str, ...]] = MappingProxyType({"llip": ("lip",)})

_NO_PLACE = (
    "marker markers mrk mkr mark face facial actor skin point pt trk track loc jnt joint bone ctrl "
    "main geo null"
)
# Words without a place.
IGNORED = frozenset(_NO_PLACE.split())

WORDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        word: _COMPOUNDS.get(
            word, tuple(concept for concept, words in _TEXT.items() if word in words.split())
        )
        for word in sorted({w for text in _TEXT.values() for w in text.split()} | set(_COMPOUNDS))
    }
)
