/* Throughput of the C ABI's batches, as one JSON object on stdout.
 *
 * For each preset, number of wavelengths and call, the program measures evaluations per second, with one thread and
 * with one thread on every core. An evaluation is one item at one wavelength. Figures are medians of REPETITIONS
 * timings by the wall clock; each repetition times all calls in turn. Incident directions are uniform over the
 * hemisphere, as is every second outgoing one. The others are sampled by the surface. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "sunbeam.h"

enum {
    COUNT           = 4096, /* items of a batch */
    WAVELENGTHS_MAX = 16,   /* largest number of wavelengths of an item */
    REPETITIONS     = 7,    /* timings of which the median counts */
    PASSES          = 8,    /* calls of a timing */
    CORES_MAX       = 256   /* largest number of threads */
};

static const char *PRESETS[] = { "blazed", "elaphe", "xenopeltis" };
/* Numbers of wavelengths of an item. */
static const size_t WAVELENGTHS[] = { 1, 4, 16 };
enum { PRESET_COUNT = 3, WAVELENGTHS_COUNT = 3 };

/* The timed functions sunbeam_surface_NAME. */
enum { EVAL, PDF, EVAL_PDF, SAMPLE, CALL_COUNT };
static const char *CALLS[CALL_COUNT] = { "eval", "pdf", "eval_pdf", "sample" };

/* The arguments and the results of a batch. */
typedef struct {
    const sunbeam_surface *surface;
    size_t wavelengths; /* number of wavelengths of an item */
    int call;           /* index in CALLS */
    float wi[COUNT][3], wo[COUNT][3], u[COUNT][3], nm[COUNT][WAVELENGTHS_MAX];
    float f[COUNT][WAVELENGTHS_MAX], pdf[COUNT], sampled[COUNT][3];
} batch;

/* Exits with the library's message after an error. */
static void check(sunbeam_status status) {
    if (status != SUNBEAM_STATUS_OK) {
        fprintf(stderr, "%s\n", sunbeam_last_error());
        exit(1);
    }
}

/* A random number in [0, 1): the upper bits of a linear congruential generator with Knuth's constants. */
static float random_unit(void) {
    static unsigned long long state = 1;
    state                           = state * 6364136223846793005ull + 1442695040888963407ull;
    return (float) (state >> 40) / 16777216.f;
}

/* A direction uniform in solid angle, at least 0.02 above the horizon in cosine. */
static void random_direction(float w[3]) {
    const float z = .02f + .98f * random_unit(), r = sqrtf(1.f - z * z), phi = 6.2831853f * random_unit();
    w[0] = r * cosf(phi), w[1] = r * sinf(phi), w[2] = z;
}

/* Calls the batch's function once. */
static void run(batch *b) {
    const size_t n          = b->wavelengths;
    const sunbeam_floats wi = { b->wi[0], 3 }, wo = { b->wo[0], 3 }, u = { b->u[0], 3 },
                         nm    = { b->nm[0], WAVELENGTHS_MAX };
    const sunbeam_floats_out f = { b->f[0], WAVELENGTHS_MAX }, pdf = { b->pdf, 1 }, to = { b->sampled[0], 3 };
    switch (b->call) {
        case EVAL:
            check(sunbeam_surface_eval(b->surface, COUNT, wi, wo, n, nm, f));
            break;
        case PDF:
            check(sunbeam_surface_pdf(b->surface, COUNT, wi, wo, n, nm, pdf));
            break;
        case EVAL_PDF:
            check(sunbeam_surface_eval_pdf(b->surface, COUNT, wi, wo, n, nm, f, pdf));
            break;
        default:
            check(sunbeam_surface_sample(b->surface, COUNT, wi, n, nm, u, to, pdf, f));
            break;
    }
}

/* Seconds by a clock that only runs forward. */
static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double) now.tv_sec + 1e-9 * (double) now.tv_nsec;
}

/* Order of two numbers, for qsort. */
static int ascending(const void *a, const void *b) {
    const double x = *(const double *) a, y = *(const double *) b;
    return (x > y) - (x < y);
}

/* Body of a thread: calls the function of the batch `argument` PASSES times. */
static void *run_passes(void *argument) {
    for (int pass = 0; pass < PASSES; ++pass)
        run(argument);
    return NULL;
}

/* Evaluations per second by the wall clock, with `cores` threads that have a copy of the batch each. */
static double per_second(const batch *one, long cores) {
    pthread_t threads[CORES_MAX];
    batch *batches = malloc((size_t) cores * sizeof *batches);
    if (!batches)
        exit(1);
    for (long t = 0; t < cores; ++t)
        batches[t] = *one;
    const double start = seconds();
    for (long t = 0; t < cores; ++t)
        if (pthread_create(&threads[t], NULL, run_passes, &batches[t]))
            exit(1);
    for (long t = 0; t < cores; ++t)
        pthread_join(threads[t], NULL);
    const double spent = seconds() - start;
    free(batches);
    return (double) cores * PASSES * COUNT * (double) one->wavelengths / spent;
}

/* Fills a batch with random arguments; every second outgoing direction is a sample above the horizon. */
static void fill(batch *b) {
    for (int i = 0; i < COUNT; ++i) {
        random_direction(b->wi[i]), random_direction(b->wo[i]);
        for (int k = 0; k < 3; ++k)
            b->u[i][k] = random_unit();
        for (int k = 0; k < WAVELENGTHS_MAX; ++k)
            b->nm[i][k] = 380.f + 400.f * random_unit();
    }
    b->wavelengths = 1, b->call = SAMPLE;
    run(b);
    for (int i = 0; i < COUNT; i += 2)
        if (b->sampled[i][2] > 0.f)
            memcpy(b->wo[i], b->sampled[i], sizeof b->wo[i]);
}

/* Times all calls of a batch, and prints a row for each number of wavelengths and call. `preset` is an index in
 * PRESETS, and `cores` the number of threads of the second figure. */
static void print_rows(batch *b, int preset, long cores) {
    /* Evaluations per second, with one thread [0] and with one on every core [1]. */
    static double found[WAVELENGTHS_COUNT][CALL_COUNT][2][REPETITIONS];
    for (int repetition = 0; repetition < REPETITIONS; ++repetition)
        for (int w = 0; w < WAVELENGTHS_COUNT; ++w)
            for (int call = 0; call < CALL_COUNT; ++call) {
                b->wavelengths = WAVELENGTHS[w], b->call = call;
                found[w][call][0][repetition] = per_second(b, 1);
                found[w][call][1][repetition] = per_second(b, cores);
            }
    for (int w = 0; w < WAVELENGTHS_COUNT; ++w)
        for (int call = 0; call < CALL_COUNT; ++call) {
            for (int all = 0; all < 2; ++all)
                qsort(found[w][call][all], REPETITIONS, sizeof(double), ascending);
            printf("%s\n{\"preset\": \"%s\", \"wavelengths\": %zu, \"call\": \"%s\", \"per_second\": %.4g, "
                   "\"per_second_all_cores\": %.4g}",
                   preset + w + call > 0 ? "," : "", PRESETS[preset], WAVELENGTHS[w], CALLS[call],
                   found[w][call][0][REPETITIONS / 2], found[w][call][1][REPETITIONS / 2]);
        }
}

int main(void) {
    static batch b;
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    cores      = cores < 1 ? 1 : cores > CORES_MAX ? CORES_MAX : cores;
    printf("{\"version\": \"%s\", \"items\": %d, \"repetitions\": %d, \"cores\": %ld, \"rows\": [", sunbeam_version(),
           COUNT, REPETITIONS, cores);
    for (int preset = 0; preset < PRESET_COUNT; ++preset) {
        char config[160];
        sunbeam_surface *surface = NULL;
        snprintf(config, sizeof config, "{\"preset\": \"%s\", \"obliquity\": \"stam\", \"eta\": 1.56}",
                 PRESETS[preset]);
        check(sunbeam_surface_new(config, &surface));
        b.surface = surface;
        fill(&b);
        print_rows(&b, preset, cores);
        sunbeam_surface_free(surface);
    }
    printf("\n]}\n");
    return 0;
}
