/* One surface in many threads: every thread gets the answers of a single thread, and its own error messages. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sunbeam.h"

enum { THREADS = 8, ROUNDS = 20, COUNT = 64 };

static const char *CONFIG = "{\"preset\": \"blazed\", \"coherence_length\": 10, \"conserve_energy\": false, "
                            "\"tolerance\": 0.01}";

typedef struct {
    const sunbeam_surface *surface;
    float expected_f[COUNT], expected_wo[COUNT][3];
    const char *wrong;
} task;

/* Evaluates and samples a batch with queries equal in all threads. */
static int batch(const sunbeam_surface *surface, float f[COUNT], float wo[COUNT][3]) {
    const float wi[3] = { 0.6f, 0.f, 0.8f }, nm = 550.f;
    float u[COUNT][3], pdf[COUNT], weight[COUNT];
    for (int i = 0; i < COUNT; ++i)
        for (int k = 0; k < 3; ++k)
            u[i][k] = (float) ((i * 37 + k * 11) % COUNT) / COUNT;
    memset(wo, 0, COUNT * sizeof *wo);
    if (sunbeam_surface_sample(surface, COUNT, (sunbeam_floats){ wi, 0 }, 1, (sunbeam_floats){ &nm, 0 },
                               (sunbeam_floats){ u[0], 3 }, (sunbeam_floats_out){ wo[0], 3 },
                               (sunbeam_floats_out){ pdf, 1 }, (sunbeam_floats_out){ weight, 1 }))
        return 0;
    for (int i = 0; i < COUNT; ++i) /* samples below the horizon are zeros */
        if (wo[i][2] == 0.f)
            wo[i][2] = 1.f;
    return !sunbeam_surface_eval(surface, COUNT, (sunbeam_floats){ wi, 0 }, (sunbeam_floats){ wo[0], 3 }, 1,
                                 (sunbeam_floats){ &nm, 0 }, (sunbeam_floats_out){ f, 1 });
}

static void *work(void *argument) {
    task *mine = argument;
    if (strlen(sunbeam_last_error()) > 0)
        mine->wrong = "a new thread has the message of another";
    for (int round = 0; round < ROUNDS; ++round) {
        float f[COUNT], wo[COUNT][3];
        if (!batch(mine->surface, f, wo))
            mine->wrong = sunbeam_last_error();
        else if (memcmp(f, mine->expected_f, sizeof f) || memcmp(wo, mine->expected_wo, sizeof wo))
            mine->wrong = "the answers differ from those of one thread";
        /* Each thread makes and frees a surface of its own, and has its own error. */
        sunbeam_surface *own = NULL;
        if (sunbeam_surface_new("{\"tolerance\": 2}", &own) != SUNBEAM_STATUS_BAD_CONFIG ||
            !strstr(sunbeam_last_error(), "tolerance"))
            mine->wrong = "a bad configuration is not refused";
        if (sunbeam_surface_new("{\"preset\": \"flat\", \"conserve_energy\": false, \"tolerance\": 0.1}", &own))
            mine->wrong = "a surface cannot be made beside others";
        sunbeam_surface_free(own);
    }
    return NULL;
}

int main(void) {
    sunbeam_surface *surface = NULL;
    static task tasks[THREADS];
    pthread_t threads[THREADS];
    int wrong = 0;
    if (sunbeam_surface_new(CONFIG, &surface) || !batch(surface, tasks[0].expected_f, tasks[0].expected_wo)) {
        fprintf(stderr, "%s\n", sunbeam_last_error());
        return 1;
    }
    for (int t = 0; t < THREADS; ++t) {
        tasks[t]         = tasks[0];
        tasks[t].surface = surface;
        if (pthread_create(&threads[t], NULL, work, &tasks[t]))
            return 1;
    }
    for (int t = 0; t < THREADS; ++t) {
        pthread_join(threads[t], NULL);
        if (tasks[t].wrong) {
            fprintf(stderr, "thread %d: %s\n", t, tasks[t].wrong);
            wrong = 1;
        }
    }
    sunbeam_surface_free(surface);
    printf("%d threads, %d batches each\n", THREADS, ROUNDS);
    return wrong;
}
