"""pbrt's named spectra."""

from __future__ import annotations

Triple = tuple[float, float, float]

#: eta and k of metals in red, green and blue: pbrt-v4's measured spectra as colors under D65, which give the spectrum's
#: reflectance at normal incidence to 0.02, without gold's and brass's to 0.01.
METALS: dict[str, tuple[Triple, Triple]] = {
    "Ag": ((0.12849, 0.12353, 0.15088), (4.06518, 3.28615, 2.39156)),
    "Al": ((1.40751, 0.92664, 0.58402), (7.74094, 6.60235, 5.3599)),
    "Au": ((0.07996, 0.4051, 1.56069), (3.39051, 2.50348, 1.77087)),
    "Cu": ((0.10517, 0.9779, 1.20456), (3.27379, 2.59247, 2.36896)),
    "CuZn": ((0.41844, 0.52008, 1.12293), (3.66793, 2.68058, 1.77125)),
    "MgO": ((1.73384, 1.74092, 1.75338), (0.0, 0.0, 0.0)),
    "TiO2": ((2.86065, 2.95648, 3.18523), (0.00009, 0.0, 0.00057)),
}
#: Index of refraction at 587.56 nm and Abbe number of glasses.
GLASSES = {
    "BK7": (1.51680, 63.99),
    "BAF10": (1.67000, 47.04),
    "FK51A": (1.48656, 84.91),
    "LASF9": (1.85027, 32.21),
    "F5": (1.67272, 32.29),
    "F10": (1.72828, 28.47),
    "F11": (1.78474, 25.71),
}
#: Chromaticities x and y of illuminants (CIE 15:2004; ACES: SMPTE ST 2065-1).
ILLUMINANTS = {
    "stdillum-A": (0.44757, 0.40745),
    "stdillum-D50": (0.34567, 0.35850),
    "stdillum-D65": (0.31272, 0.32903),
    "stdillum-F1": (0.3131, 0.3371),
    "stdillum-F2": (0.3721, 0.3751),
    "stdillum-F3": (0.4091, 0.3941),
    "stdillum-F4": (0.4402, 0.4031),
    "stdillum-F5": (0.3138, 0.3452),
    "stdillum-F6": (0.3779, 0.3882),
    "stdillum-F7": (0.3129, 0.3292),
    "stdillum-F8": (0.3458, 0.3586),
    "stdillum-F9": (0.3741, 0.3727),
    "stdillum-F10": (0.3458, 0.3588),
    "stdillum-F11": (0.3805, 0.3769),
    "stdillum-F12": (0.4370, 0.4042),
    "illum-acesD60": (0.32168, 0.33767),
}
#: Matrices from other color spaces to linear Rec. 709, which keep white: from their primaries.
SPACES = {
    "dci-p3": ((1.2249402, -0.2249402, 0.0), (-0.0420570, 1.0420570, 0.0), (-0.0196376, -0.0786361, 1.0982736)),
    "rec2020": (
        (1.6604910, -0.5876411, -0.0728499),
        (-0.1245505, 1.1328999, -0.0083494),
        (-0.0181508, -0.1005789, 1.1187297),
    ),
    "aces2065-1": (
        (2.5216862, -1.1341310, -0.3875552),
        (-0.2764799, 1.3727191, -0.0962392),
        (-0.0153781, -0.1529753, 1.1683534),
    ),
}
