// Sheen of fibres on a surface, as in glTF's KHR_materials_sheen, in the frame of its normal:
//   D(h) = (2 + n)/(2·pi)·sin^n θh with n = 1/roughness² (Estevez and Kulla 2017, "Production Friendly Microfacet Sheen
//   BRDF")
//   V = 1/(4·(cos wo + cos wi − cos wo·cos wi)) (Neubelt and Pettineo 2013)
// and E(cos wo) = ∫ D·V·cos wi dwi, the albedo of white fibres: a polynomial in x = 2·√cos − 1, whose coefficients are
// polynomials in y = 1 + 2·log10(roughness), interpolated at the Chebyshev points of both. Its error is at most 2.5e-3,
// near the horizon, and 7e-4 for cos > 0.02 (tests/rendering/test_sheen.py computes the integral and the interpolation
// in float64).
#define SMOOTHEST 0.1f   // smoother fibres would reflect at grazing angles only
#define SHEEN_X 12
#define SHEEN_Y 8

constant float SHEEN_ALBEDO[SHEEN_X][SHEEN_Y] = {   // [power of x][power of y]
    {0.424335f, 0.09419895f, -0.2370303f, 0.09304167f, 0.07135911f, -0.05902696f, -0.00321419f, 0.01022663f},
    {-0.8458075f, 0.8411106f, 0.02059139f, -0.6078592f, 0.3987318f, 0.007244946f, -0.1339176f, 0.05442907f},
    {0.3964658f, -1.228134f, 1.520156f, -0.6252988f, -0.5671945f, 0.7590921f, -0.1310534f, -0.1035227f},
    {0.1158512f, -0.07578459f, -0.5817248f, 1.477229f, -1.744682f, 0.6348143f, 0.7175632f, -0.5439299f},
    {-0.07647331f, 0.380076f, -0.8916138f, 0.8171873f, 0.4560146f, -1.426715f, 0.8226179f, -0.08815821f},
    {0.007408058f, 0.02694268f, -0.1811338f, -0.3937365f, 2.342967f, -1.975402f, -1.041904f, 1.223626f},
    {-0.1081161f, 0.1707701f, -0.06554937f, -0.3930459f, 0.7127632f, 0.3424991f, -1.511525f, 0.8250306f},
    {0.08495592f, -0.1785887f, 0.5534054f, -0.5200681f, -1.350162f, 1.914693f, 0.4474761f, -0.932899f},
    {0.122178f, -0.2380885f, 0.4085732f, -0.1672698f, -0.8961964f, 0.5706558f, 1.168002f, -0.9393628f},
    {-0.1083258f, 0.2058383f, -0.3731323f, 0.4214619f, 0.2249697f, -0.6763896f, 0.08697562f, 0.1919791f},
    {-0.08040261f, 0.1553992f, -0.2469207f, 0.1815462f, 0.2585986f, -0.2592393f, -0.3454619f, 0.3169633f},
    {0.06992617f, -0.131919f, 0.1645659f, -0.1574002f, 0.07664667f, 0.04872099f, -0.08088277f, 0.02789874f},
};

// power: n. albedo: coefficients of E in x at this roughness.
typedef struct { real power, albedo[SHEEN_X]; } Fibres;

static inline Fibres fibres_of(real roughness) {
    Fibres fibres;
    real rough = maximum(roughness, (real)(SMOOTHEST)), y = 1.0f + 0.868588964f * log(rough);   // 2/ln 10
    fibres.power = 1.0f / (rough * rough);
    for (int k = 0; k < SHEEN_X; ++k) {
        real sum = ZERO;
        for (int j = SHEEN_Y - 1; j >= 0; --j) sum = sum * y + SHEEN_ALBEDO[k][j];
        fibres.albedo[k] = sum;
    }
    return fibres;
}

static inline real fibres_d(const Fibres *fibres, real cos_h) {
    real sine2 = maximum(1.0f - cos_h * cos_h, (real)(1e-30f));
    return (2.0f + fibres->power) * (0.5f / PI) * exp(0.5f * fibres->power * log(sine2));
}

// The albedo E.
static inline real fibres_albedo(const Fibres *fibres, real cos_theta) {
    real x = 2.0f * sqrt(minimum(absolute(cos_theta), ONE)) - 1.0f, sum = ZERO;
    for (int k = SHEEN_X - 1; k >= 0; --k) sum = sum * x + fibres->albedo[k];
    return maximum(sum, ZERO);
}
