// C interface of sunbeam: the diffraction BSDF of a measured relief, evaluated and sampled in batches of directions.
//
// A surface is created from parameters in JSON, or from an array of heights, and then used by any number of threads.
// docs/plugin.md describes the parameters, docs/tour-c.md has complete programs.

#ifndef SUNBEAM_H
#define SUNBEAM_H

#include <stddef.h>
#include <stdint.h>

// Major version of this header. `sunbeam_version` returns the version of the library at run time.
#define SUNBEAM_VERSION_MAJOR 0

// Minor version of this header.
#define SUNBEAM_VERSION_MINOR 1

// Patch version of this header.
#define SUNBEAM_VERSION_PATCH 0

// Result of a call. With any code but `SUNBEAM_STATUS_OK`, `sunbeam_last_error` returns a message.
typedef enum {
  // Success.
  SUNBEAM_STATUS_OK = 0,
  // A required pointer is null, or a pointer is misaligned.
  SUNBEAM_STATUS_BAD_POINTER = 1,
  // A number, direction, stride or size is not accepted. If items of a batch are bad, their results are zeros
  // and all other items have been computed.
  SUNBEAM_STATUS_BAD_VALUE = 2,
  // The configuration is not JSON in UTF-8, contradicts itself, or has an unknown name or a value that is refused.
  // Or an environment variable of the cache has a value that is refused.
  SUNBEAM_STATUS_BAD_CONFIG = 3,
  // The file of heights cannot be read, or the heights of a file or an array are refused, for example because
  // some are missing.
  SUNBEAM_STATUS_BAD_HEIGHT_FIELD = 4,
  // The tables cannot be built, for example because they would be too large.
  SUNBEAM_STATUS_BAD_TABLES = 5,
  // The buffer is too small for the text. The required size has been written to `*needed`.
  SUNBEAM_STATUS_BUFFER_TOO_SMALL = 6,
  // A defect of the library, such as a caught panic.
  SUNBEAM_STATUS_INTERNAL = 7,
} sunbeam_status;

// A surface with its tables. It never changes after its creation, so any number of threads may use it at once.
typedef struct sunbeam_surface sunbeam_surface;

// A strided array of floats to be read, owned by the caller: item `i` begins at `data + i * stride`.
//
// The stride is in floats and may be negative. With stride 0 all items have the same values.
typedef struct {
  // Beginning of the first item. It may be null if there are no items.
  const float *data;
  // Distance between the beginnings of consecutive items, in floats.
  ptrdiff_t stride;
} sunbeam_floats;

// A strided array of floats to be written, owned by the caller: item `i` begins at `data + i * stride`.
//
// The stride is in floats and may be negative. Items must not overlap.
typedef struct {
  // Beginning of the first item. It may be null if there are no items.
  float *data;
  // Distance between the beginnings of consecutive items, in floats.
  ptrdiff_t stride;
} sunbeam_floats_out;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Returns the version of the library in use, such as `0.1.0`, as a static string.
const char *sunbeam_version(void);

// Returns the message of the last failed call of this thread, one line of UTF-8. The string is empty if no call
// has failed. The pointer is never null.
//
// The string is valid until the next failing call of this thread, or until the thread ends.
const char *sunbeam_last_error(void);

// Creates a surface from a JSON object of parameters, such as
// `{"preset": "blazed", "period": 2.5, "coherence_length": 65}`. All parameters have defaults. Lengths are in
// micrometres.
//
// Building the tables takes up to some seconds; reading them from the cache takes a fraction of a second. The
// environment variables SUNBEAM_CACHE, SUNBEAM_CACHE_DIR and SUNBEAM_CACHE_LIMIT_MB control the cache.
//
// `*surface` is null unless the call returns `SUNBEAM_STATUS_OK`. Free it with `sunbeam_surface_free`.
//
// Requirements:
// `config_json` must be a string with a terminating NUL, and `surface` a valid pointer to a pointer.
sunbeam_status sunbeam_surface_new(const char *config_json, sunbeam_surface **surface);

// Creates a surface from an array of heights: `ny` rows of `nx` heights in micrometres. Row `iy` begins at
// `heights_um.data + iy * heights_um.stride` and lies at y = `iy * pixel_y_um`; height `ix` of a row lies at
// x = `ix * pixel_x_um`. The heights are copied.
//
// The configuration has the parameters of `sunbeam_surface_new`, except those of presets and files; `fill` is
// accepted. `level` defaults to `plane` and `tiling` to `aperiodic`, as for files. With `theory` `rigorous` the
// array is one period of a grating, and `aperiodic` is refused. Heights that are NaN, infinite or of magnitude
// 1e30 or more are missing points. They are an error unless `fill` is `laplace` or `mean`. More heights than
// `build_limit` allows are an error: each takes at least 24 bytes of `build_limit` times 8 GB.
//
// `*surface` is null unless the call returns `SUNBEAM_STATUS_OK`. Free it with `sunbeam_surface_free`.
//
// Requirements:
// The requirements of `sunbeam_surface_new` apply. `nx` floats must be readable from the beginning of each row.
sunbeam_status sunbeam_surface_from_heights(const char *config_json,
                                            sunbeam_floats heights_um,
                                            size_t nx,
                                            size_t ny,
                                            double pixel_x_um,
                                            double pixel_y_um,
                                            sunbeam_surface **surface);

// Frees a surface. Null is ignored.
//
// Requirements:
// `surface` must have been created by `sunbeam_surface_new` or `sunbeam_surface_from_heights`, not have been
// freed before, and not be used afterwards.
void sunbeam_surface_free(sunbeam_surface *surface);

// Writes a JSON object with the configuration (key `config`), the size of the tables and their measured error. For a
// surface from a file, its key `file` has the sources of size, unit, orientation and channel, the missing points, and
// warnings.
//
// `*needed` receives the size of the text in bytes, including the terminating NUL. If `capacity` is smaller,
// nothing is written to `buffer`, and the call returns `SUNBEAM_STATUS_BUFFER_TOO_SMALL`. `buffer` may be null if
// `capacity` is 0.
//
// Requirements:
// `surface` must not have been freed, `buffer` must have room for `capacity` bytes, and `needed` must be a valid
// pointer.
sunbeam_status sunbeam_surface_describe(const sunbeam_surface *surface,
                                        char *buffer,
                                        size_t capacity,
                                        size_t *needed);

// Evaluates the BSDF for `count` pairs of directions, each at `wavelength_count` wavelengths.
//
// - Item `i` of `wi` is the direction to the light, item `i` of `wo` that to the viewer. Both point away from the
//   surface: three floats, of length 1 within 1e-3, in the surface's frame (z is the normal, x runs along the rows of
//   the relief).
// - Item `i` of `wavelength_nm` holds `wavelength_count` wavelengths (1 to 4096), each in [360, 830] nm.
// - Item `i` of `f` receives the BRDF at each wavelength in 1/sr, without the cosine. It includes the Fresnel factor
//   if the configuration has `eta`. It is zero unless both directions lie above the surface.
//
// With `transmission`, directions may lie on either side of the surface. Below an interface they are directions in
// the medium. `f` is then the BSDF of light from `wi` to `wo`: its power per solid angle, divided by |cos(theta_o)|.
//
// An item with a value out of these ranges is bad: its results are zeros, and all other items are computed. The
// call then returns `SUNBEAM_STATUS_BAD_VALUE` with a message about the first bad item.
//
// Requirements:
// `surface` must not have been freed. All items of inputs must be readable. All items of outputs must be writable,
// and nothing else may access them during the call.
sunbeam_status sunbeam_surface_eval(const sunbeam_surface *surface,
                                    size_t count,
                                    sunbeam_floats wi,
                                    sunbeam_floats wo,
                                    size_t wavelength_count,
                                    sunbeam_floats wavelength_nm,
                                    sunbeam_floats_out f);

// Computes the density in 1/sr with which `sunbeam_surface_sample` samples the direction `wo`.
//
// Item `i` of `pdf` receives one float, the mean density over the wavelengths of the item. It is zero unless both
// directions lie above the surface, or the configuration has `transmission`. Other arguments are those of
// `sunbeam_surface_eval`.
//
// Requirements:
// The requirements of `sunbeam_surface_eval` apply.
sunbeam_status sunbeam_surface_pdf(const sunbeam_surface *surface,
                                   size_t count,
                                   sunbeam_floats wi,
                                   sunbeam_floats wo,
                                   size_t wavelength_count,
                                   sunbeam_floats wavelength_nm,
                                   sunbeam_floats_out pdf);

// Combines `sunbeam_surface_eval` and `sunbeam_surface_pdf`, at the cost of the latter.
//
// Requirements:
// The requirements of `sunbeam_surface_eval` apply.
sunbeam_status sunbeam_surface_eval_pdf(const sunbeam_surface *surface,
                                        size_t count,
                                        sunbeam_floats wi,
                                        sunbeam_floats wo,
                                        size_t wavelength_count,
                                        sunbeam_floats wavelength_nm,
                                        sunbeam_floats_out f,
                                        sunbeam_floats_out pdf);

// Samples `count` outgoing directions, each for all wavelengths of its item.
//
// - Item `i` of `u` holds three random numbers in [0, 1).
// - Item `i` of `wo` receives the direction: three floats.
// - Item `i` of `pdf` receives its density, one float, as `sunbeam_surface_pdf` computes it.
// - Item `i` of `weight` receives `f |cos(theta_o)| / pdf` at each wavelength.
//
// With `transmission`, `wi` and the samples may lie on either side of the surface. All results of an item are zeros
// if the direction drawn lies beyond the horizon of its side or has density 0, or if `wi` lies below the surface
// without `transmission`. Such a sample is valid and contributes nothing. Other arguments and the treatment of bad
// items are those of `sunbeam_surface_eval`.
//
// Requirements:
// The requirements of `sunbeam_surface_eval` apply.
sunbeam_status sunbeam_surface_sample(const sunbeam_surface *surface,
                                      size_t count,
                                      sunbeam_floats wi,
                                      size_t wavelength_count,
                                      sunbeam_floats wavelength_nm,
                                      sunbeam_floats u,
                                      sunbeam_floats_out wo,
                                      sunbeam_floats_out pdf,
                                      sunbeam_floats_out weight);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SUNBEAM_H */
