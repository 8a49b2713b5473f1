#ifndef SUNBEAM_H
#define SUNBEAM_H

#include <stddef.h>
#include <stdint.h>

// The first number of the version of this header; `sunbeam_version` says that of the library which the program runs with.
#define SUNBEAM_VERSION_MAJOR 0

// The second number.
#define SUNBEAM_VERSION_MINOR 1

// The third number.
#define SUNBEAM_VERSION_PATCH 0

// What a call ended with. Anything but `SUNBEAM_STATUS_OK` comes with a message from `sunbeam_last_error`.
typedef enum {
  // It worked.
  SUNBEAM_STATUS_OK = 0,
  // A pointer is null that must not be, or does not point to a whole float.
  SUNBEAM_STATUS_BAD_POINTER = 1,
  // A number, direction, stride or size is outside of what is accepted. Where it is one of a batch, the other items
  // were answered all the same, and the bad ones with zeros.
  SUNBEAM_STATUS_BAD_VALUE = 2,
  // The configuration is not JSON, has an unknown name, or a value out of range; or an environment variable has.
  SUNBEAM_STATUS_BAD_CONFIG = 3,
  // A height field cannot be read, or is not usable.
  SUNBEAM_STATUS_BAD_HEIGHT_FIELD = 4,
  // The tables cannot be built: they would be too large.
  SUNBEAM_STATUS_BAD_TABLES = 5,
  // The buffer is too small for the text; the size that it needs was written.
  SUNBEAM_STATUS_BUFFER_TOO_SMALL = 6,
  // A defect of the library itself.
  SUNBEAM_STATUS_INTERNAL = 7,
} sunbeam_status;

// A surface with its tables. It is never changed after it was made, so any number of threads may use it at once.
typedef struct sunbeam_surface sunbeam_surface;

// Floats that the caller owns, to be read: item `i` begins at `data + i * stride`.
//
// The stride is counted in floats, may be negative, and 0 gives every item the same values.
typedef struct {
  // Where the first item begins.
  const float *data;
  // Floats from the beginning of an item to that of the next.
  ptrdiff_t stride;
} sunbeam_floats;

// Floats that the caller owns, to be written: item `i` begins at `data + i * stride`.
//
// The stride is counted in floats and may be negative; items must not overlap.
typedef struct {
  // Where the first item begins.
  float *data;
  // Floats from the beginning of an item to that of the next.
  ptrdiff_t stride;
} sunbeam_floats_out;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of the library, such as `0.1.0`. Static.
const char *sunbeam_version(void);

// What went wrong in the last call of this thread that failed, in one line of UTF-8; empty where none did.
//
// Valid until the next call of this thread that fails. Never null.
const char *sunbeam_last_error(void);

// Makes a surface from a JSON object whose keys are the parameters' names, such as
// `{"preset": "blazed", "period": 2.5, "coherence_length": 65}`; all have defaults. Lengths are in micrometres.
//
// It takes up to some seconds, or a fraction of one where the tables are in the cache (environment variables SUNBEAM_CACHE,
// SUNBEAM_CACHE_DIR and SUNBEAM_CACHE_LIMIT_MB). `*surface` is null unless this returns `SUNBEAM_STATUS_OK`; give it back with
// `sunbeam_surface_free`.
//
// What the caller has to see to:
// `config_json` must be a string with a terminating NUL, `surface` a place for a pointer.
sunbeam_status sunbeam_surface_new(const char *config_json,
                                   sunbeam_surface **surface);

// Makes a surface from heights in memory: `ny` rows of `nx` heights in micrometres, row `iy` beginning at
// `heights_um.data + iy * heights_um.stride` and lying at y = `iy * pixel_y_um`.
//
// The configuration is as for `sunbeam_surface_new` without what is about presets and files; as for files, `level` is
// `plane` and `tiling` is `aperiodic` unless it says otherwise. Heights that are NaN, infinite or from ±1e30 on are holes:
// they are refused unless `fill` is `laplace` or `mean`. The heights are copied.
//
// What the caller has to see to:
// As `sunbeam_surface_new`, and `nx` floats must be readable from the beginning of each row.
sunbeam_status sunbeam_surface_from_heights(const char *config_json,
                                            sunbeam_floats heights_um,
                                            size_t nx,
                                            size_t ny,
                                            double pixel_x_um,
                                            double pixel_y_um,
                                            sunbeam_surface **surface);

// Gives a surface back. Null is fine; nothing may use it afterwards.
//
// What the caller has to see to:
// `surface` must come from one of the two functions that make one, and not have been given back.
void sunbeam_surface_free(sunbeam_surface *surface);

// Writes a JSON object that tells the configuration, the size of the tables and their measured error; for a file of heights
// also, under `file`, what its size, unit, orientation, channel and holes were taken from.
//
// `*needed` is the size of the text with its terminating NUL, so a first call with `capacity` 0 asks for it (and returns
// `SUNBEAM_STATUS_BUFFER_TOO_SMALL`); `buffer` may then be null.
//
// What the caller has to see to:
// `surface` must be alive, `buffer` have room for `capacity` bytes, and `needed` be a place for a size.
sunbeam_status sunbeam_surface_describe(const sunbeam_surface *surface,
                                        char *buffer,
                                        size_t capacity,
                                        size_t *needed);

// Evaluates the BSDF for `count` pairs of directions, each at `wavelength_count` wavelengths.
//
// Item `i` of `wi` and `wo` is a direction: three floats, of length 1 to 1e-3, in the surface's frame (z its normal, x along
// the relief's rows), both pointing away from it. Item `i` of `wavelength_nm` is `wavelength_count` floats in [360, 830].
// Item `i` of `f` receives as many: the reflectance in 1/sr, without the cosine and with the Fresnel reflectance where the
// configuration has `eta`; zeros unless both directions lie above the surface.
//
// An item that is not usable is answered with zeros, the others are answered all the same, and the call returns
// `SUNBEAM_STATUS_BAD_VALUE` with a message about the first such item.
//
// What the caller has to see to:
// `surface` must be alive; every item of the arrays must be readable, those of `f` writable, by this call alone.
sunbeam_status sunbeam_surface_eval(const sunbeam_surface *surface,
                                    size_t count,
                                    sunbeam_floats wi,
                                    sunbeam_floats wo,
                                    size_t wavelength_count,
                                    sunbeam_floats wavelength_nm,
                                    sunbeam_floats_out f);

// The density with which `sunbeam_surface_sample` finds the direction `wo`, per solid angle: one float an item, the mean over
// the wavelengths that it carries. The arguments are those of `sunbeam_surface_eval`.
//
// What the caller has to see to:
// As `sunbeam_surface_eval`.
sunbeam_status sunbeam_surface_pdf(const sunbeam_surface *surface,
                                   size_t count,
                                   sunbeam_floats wi,
                                   sunbeam_floats wo,
                                   size_t wavelength_count,
                                   sunbeam_floats wavelength_nm,
                                   sunbeam_floats_out pdf);

// `sunbeam_surface_eval` and `sunbeam_surface_pdf` in one, for the cost of the latter.
//
// What the caller has to see to:
// As `sunbeam_surface_eval`.
sunbeam_status sunbeam_surface_eval_pdf(const sunbeam_surface *surface,
                                        size_t count,
                                        sunbeam_floats wi,
                                        sunbeam_floats wo,
                                        size_t wavelength_count,
                                        sunbeam_floats wavelength_nm,
                                        sunbeam_floats_out f,
                                        sunbeam_floats_out pdf);

// Samples `count` outgoing directions, one for all the wavelengths that an item carries.
//
// Item `i` of `u` is three random numbers in [0, 1). Item `i` of `wo` receives the direction, of `pdf` its density (that of
// `sunbeam_surface_pdf`), of `weight` for each wavelength `f cos(theta_o) / pdf`. A sample that falls below the horizon counts
// as zero: all of its results are zeros. Else the arguments, and what happens to items that are not usable, are as for
// `sunbeam_surface_eval`.
//
// What the caller has to see to:
// As `sunbeam_surface_eval`.
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
