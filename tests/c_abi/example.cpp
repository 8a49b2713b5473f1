// The C interface from C++: a handle that frees itself, errors as exceptions, and arrays of structures without a copy.
//
// The exit status is 0, or 1 with a line that names the failed expectation.
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "sunbeam.h"

namespace {

/// Throws the library's message unless a call succeeded.
void check(sunbeam_status status) {
    if (status != SUNBEAM_STATUS_OK)
        throw std::runtime_error(sunbeam_last_error());
}

/// A surface of the library, which is freed with the object.
class Surface {
public:
    explicit Surface(const std::string &config) {
        sunbeam_surface *made = nullptr;
        check(sunbeam_surface_new(config.c_str(), &made));
        handle.reset(made);
    }

    const sunbeam_surface *get() const { return handle.get(); }

private:
    struct Free {
        void operator()(sunbeam_surface *surface) const { sunbeam_surface_free(surface); }
    };
    std::unique_ptr<sunbeam_surface, Free> handle;
};

/// A path vertex of a renderer; the library reads and writes its members in place.
struct Vertex {
    float wi[3];
    float wo[3];
    float wavelengths_nm[4];
    float f[4];
    float pdf;
};

/// Distance in floats between a member of a vertex and that of the next one.
constexpr std::ptrdiff_t STRIDE = sizeof(Vertex) / sizeof(float);

/// Throws unless the expectation `what` holds: an error of another class than those of the library.
void expect(bool holds, const char *what) {
    if (!holds)
        throw std::logic_error(what);
}

} // namespace

int main() try {
    const Surface mirror(R"({"preset": "flat", "coherence_length": 20, "eta": 1.5, "tolerance": 0.01,
                             "conserve_energy": false})");
    std::vector<Vertex> vertices(100);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        // From the mirror direction, x = 0.6, almost to the normal.
        const float x = .6f - .006f * float(i), z = std::sqrt(1.f - x * x);
        vertices[i] = { { -.6f, 0.f, .8f }, { x, 0.f, z }, { 400.f, 500.f, 600.f, 700.f }, {}, 0.f };
    }
    check(sunbeam_surface_eval_pdf(mirror.get(), vertices.size(), { vertices[0].wi, STRIDE },
                                   { vertices[0].wo, STRIDE }, 4, { vertices[0].wavelengths_nm, STRIDE },
                                   { vertices[0].f, STRIDE }, { &vertices[0].pdf, STRIDE }));
    for (std::size_t i = 1; i < vertices.size(); ++i)
        expect(vertices[i].f[0] <= vertices[i - 1].f[0] && vertices[i].pdf > 0.f,
               "a mirror's lobe falls away from the mirror direction");
    expect(vertices[0].f[0] > vertices[0].f[3] && vertices[0].f[3] > 1.f, "and is higher where light is bluer");
    std::printf("f of a mirror %g to %g\n", vertices[0].f[0], vertices.back().f[0]);
    try {
        Surface("{\"coherence_length\": -1}");
        expect(false, "a negative length is refused");
    } catch (const std::runtime_error &error) {
        std::printf("refused: %s\n", error.what());
        expect(std::string(error.what()).find("coherence_length") != std::string::npos, "the parameter is named");
    }
    return 0;
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
