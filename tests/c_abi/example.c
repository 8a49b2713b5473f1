/* A tour of the C interface: makes, evaluates, samples and frees a surface, and reads an error.
 *
 * The exit status is 0, or 1 with a line that names the failed expectation. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sunbeam.h"

#define EXPECT(condition)                                                                                              \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            fprintf(stderr, "%s:%d: expected %s; last error: %s\n", __FILE__, __LINE__, #condition,                    \
                    sunbeam_last_error());                                                                             \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

/* The header's version equals the library's. */
static void versions_agree(void) {
    char version[32];
    snprintf(version, sizeof version, "%d.%d.%d", SUNBEAM_VERSION_MAJOR, SUNBEAM_VERSION_MINOR, SUNBEAM_VERSION_PATCH);
    EXPECT(strcmp(version, sunbeam_version()) == 0);
}

/* A grating of period 2 um with a coherence length of 10 um. */
static const char *CONFIG = "{\"preset\": \"sinusoidal\", \"period\": 2.0, \"height\": 0.2, \"coherence_length\": 10, "
                            "\"conserve_energy\": false, \"tolerance\": 0.01}";

/* Light along the normal leaves where x is a multiple of wavelength / period: the first order is a peak. */
static void first_order(const sunbeam_surface *surface) {
    enum { COUNT = 181 };
    const float wi[3] = { 0.f, 0.f, 1.f }, wavelength_nm = 600.f;
    float wo[COUNT][3], f[COUNT], pdf[COUNT];
    int best = -1;
    for (int i = 0; i < COUNT; ++i) {
        const float x = 0.005f * (float) i; /* 0 to 0.9 */
        wo[i][0] = x, wo[i][1] = 0.f, wo[i][2] = sqrtf(1.f - x * x);
    }
    /* With a stride of 0 all items share the values. */
    const sunbeam_floats same_wi = { wi, 0 }, same_nm = { &wavelength_nm, 0 }, directions = { wo[0], 3 };
    EXPECT(sunbeam_surface_eval(surface, COUNT, same_wi, directions, 1, same_nm, (sunbeam_floats_out){ f, 1 }) ==
           SUNBEAM_STATUS_OK);
    EXPECT(sunbeam_surface_pdf(surface, COUNT, same_wi, directions, 1, same_nm, (sunbeam_floats_out){ pdf, 1 }) ==
           SUNBEAM_STATUS_OK);
    for (int i = 0; i < COUNT; ++i) {
        EXPECT(f[i] >= 0.f && isfinite(f[i]) && pdf[i] > 0.f && isfinite(pdf[i]));
        if (wo[i][0] > 0.1f && wo[i][0] < 0.5f && (best < 0 || f[i] > f[best]))
            best = i;
    }
    printf("first order at x = %.3f, expected %.3f\n", wo[best][0], 0.6 / 2.0);
    /* The value decreases with the angle across an order 0.04 wide, so its peak is slightly off the centre. */
    EXPECT(fabsf(wo[best][0] - 0.3f) < 0.011f);
}

/* The mean weight of samples is the albedo; the mean of f cos / pdf over other directions must agree with it. */
static void albedo(const sunbeam_surface *surface) {
    enum { COUNT = 20000, WAVELENGTHS = 2 };
    const float wi[3] = { 0.5f, 0.f, 0.8660254f }, wavelengths_nm[WAVELENGTHS] = { 450.f, 650.f };
    float(*u)[3] = malloc(COUNT * sizeof *u), (*wo)[3] = malloc(COUNT * sizeof *wo), *pdf = malloc(COUNT * sizeof *pdf);
    float(*weight)[WAVELENGTHS] = malloc(COUNT * sizeof *weight), (*f)[WAVELENGTHS] = malloc(COUNT * sizeof *f);
    EXPECT(u && wo && pdf && weight && f);
    for (int i = 0; i < COUNT; ++i) { /* points of a Kronecker sequence, uniform in the cube */
        u[i][0] = fmodf(0.5f + 0.8191725f * (float) (i % 5000) + 0.25f * (float) (i / 5000), 1.f);
        u[i][1] = fmodf(0.5f + 0.6710436f * (float) (i % 5000) + 0.1f * (float) (i / 5000), 1.f);
        u[i][2] = fmodf(0.5f + 0.5497005f * (float) (i % 5000) + 0.7f * (float) (i / 5000), 1.f);
    }
    EXPECT(sunbeam_surface_sample(surface, COUNT, (sunbeam_floats){ wi, 0 }, WAVELENGTHS,
                                  (sunbeam_floats){ wavelengths_nm, 0 }, (sunbeam_floats){ u[0], 3 },
                                  (sunbeam_floats_out){ wo[0], 3 }, (sunbeam_floats_out){ pdf, 1 },
                                  (sunbeam_floats_out){ weight[0], WAVELENGTHS }) == SUNBEAM_STATUS_OK);
    double sampled[WAVELENGTHS] = { 0 }, spread[WAVELENGTHS] = { 0 };
    for (int i = 0; i < COUNT; ++i)
        for (int k = 0; k < WAVELENGTHS; ++k)
            sampled[k] += weight[i][k] / COUNT;
    for (int i = 0; i < COUNT; ++i) { /* the albedo by directions uniform over the hemisphere */
        const float z = 1.f - u[i][1], r = sqrtf(1.f - z * z), phi = 6.2831853f * u[i][2];
        wo[i][0] = r * cosf(phi), wo[i][1] = r * sinf(phi), wo[i][2] = z;
    }
    EXPECT(sunbeam_surface_eval(surface, COUNT, (sunbeam_floats){ wi, 0 }, (sunbeam_floats){ wo[0], 3 }, WAVELENGTHS,
                                (sunbeam_floats){ wavelengths_nm, 0 },
                                (sunbeam_floats_out){ f[0], WAVELENGTHS }) == SUNBEAM_STATUS_OK);
    for (int i = 0; i < COUNT; ++i)
        for (int k = 0; k < WAVELENGTHS; ++k)
            spread[k] += 6.2831853 * f[i][k] * wo[i][2] / COUNT;
    for (int k = 0; k < WAVELENGTHS; ++k) {
        printf("albedo at %g nm: %.3f by samples, %.3f by even directions\n", wavelengths_nm[k], sampled[k], spread[k]);
        /* 20 000 uniform directions integrate orders of 0.04 by 0.04 with an error of about 2 %. */
        EXPECT(fabs(sampled[k] - spread[k]) < 0.1 * spread[k] && sampled[k] > 0.3 && sampled[k] < 1.5);
    }
    free(u), free(wo), free(pdf), free(weight), free(f);
}

static void description(const sunbeam_surface *surface) {
    size_t needed = 0;
    EXPECT(sunbeam_surface_describe(surface, NULL, 0, &needed) == SUNBEAM_STATUS_BUFFER_TOO_SMALL);
    char *text = malloc(needed);
    EXPECT(text && sunbeam_surface_describe(surface, text, needed, &needed) == SUNBEAM_STATUS_OK);
    EXPECT(strlen(text) + 1 == needed && strstr(text, "\"relative_error\""));
    printf("%s\n", text);
    free(text);
}

/* A relief from memory: a ramp of 3 by 2 heights. */
static void own_heights(void) {
    const float heights_um[6] = { 0.f, 0.1f, 0.f, 0.05f, 0.15f, 0.05f };
    sunbeam_surface *surface  = NULL;
    EXPECT(
        sunbeam_surface_from_heights("{\"tiling\": \"periodic\", \"coherence_length\": 4, \"conserve_energy\": false}",
                                     (sunbeam_floats){ heights_um, 3 }, 3, 2, 0.5, 0.5, &surface) == SUNBEAM_STATUS_OK);
    sunbeam_surface_free(surface);
}

static void errors(const sunbeam_surface *surface) {
    sunbeam_surface *none = (sunbeam_surface *) 1;
    EXPECT(sunbeam_surface_new("{\"preset\": \"cobra\"}", &none) == SUNBEAM_STATUS_BAD_CONFIG && none == NULL);
    EXPECT(strstr(sunbeam_last_error(), "cobra") && strstr(sunbeam_last_error(), "xenopeltis"));
    EXPECT(sunbeam_surface_new(NULL, &none) == SUNBEAM_STATUS_BAD_POINTER);
    const float w[3] = { 0.f, 0.f, 2.f }, nm = 550.f;
    float f = -1.f;
    EXPECT(sunbeam_surface_eval(surface, 1, (sunbeam_floats){ w, 3 }, (sunbeam_floats){ w, 3 }, 1,
                                (sunbeam_floats){ &nm, 1 }, (sunbeam_floats_out){ &f, 1 }) == SUNBEAM_STATUS_BAD_VALUE);
    EXPECT(f == 0.f && strstr(sunbeam_last_error(), "length 2"));
    sunbeam_surface_free(NULL);
}

int main(void) {
    sunbeam_surface *surface = NULL;
    printf("sunbeam %s\n", sunbeam_version());
    versions_agree();
    EXPECT(sunbeam_surface_new(CONFIG, &surface) == SUNBEAM_STATUS_OK);
    first_order(surface);
    albedo(surface);
    description(surface);
    errors(surface);
    own_heights();
    sunbeam_surface_free(surface);
    return 0;
}
