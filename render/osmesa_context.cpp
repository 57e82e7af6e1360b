#include <GL/osmesa.h>
#include <dlfcn.h>

#include <string>

#include "errors.h"
#include "gl_context.h"

namespace anticrack {

namespace {

constexpr const char* instead = "install libosmesa6 or use the Embree renderer";

/// OSMesa's own functions, looked up once; the library stays loaded, since its compiler does not unload
/// cleanly.
struct OsmesaLibrary {
  decltype(&OSMesaCreateContextAttribs) create = nullptr;
  decltype(&OSMesaDestroyContext) destroy = nullptr;
  decltype(&OSMesaMakeCurrent) make_current = nullptr;
  decltype(&OSMesaPixelStore) pixel_store = nullptr;
  decltype(&OSMesaGetProcAddress) address = nullptr;
  decltype(&OSMesaGetIntegerv) integer = nullptr;

  OsmesaLibrary() {
    void* library = nullptr;
    std::string reasons;
    for (const char* name : {"libOSMesa.so.8", "libOSMesa.so"}) {
      library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
      if (library != nullptr) break;
      reasons += std::string(dlerror()) + "; ";
    }
    if (library == nullptr) throw FileError("OSMesa: " + reasons + instead);
    const auto find = [&]<class Function>(const char* name, Function& function) {
      function = reinterpret_cast<Function>(dlsym(library, name));
      if (function == nullptr)
        throw FileError(std::string("OSMesa: the library lacks ") + name + "; " + instead);
    };
    find("OSMesaCreateContextAttribs", create);
    find("OSMesaDestroyContext", destroy);
    find("OSMesaMakeCurrent", make_current);
    find("OSMesaPixelStore", pixel_store);
    find("OSMesaGetProcAddress", address);
    find("OSMesaGetIntegerv", integer);
  }
};

const OsmesaLibrary& osmesa() {
  static const OsmesaLibrary library;
  return library;
}

class OsmesaContext : public GlContext {
 public:
  OsmesaContext(int width, int height) : pixels_(std::size_t(width) * std::size_t(height) * 4) {
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              24,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              3,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              3,
                              0};
    context_ = osmesa().create(attributes, nullptr);
    if (context_ == nullptr)
      throw InputError("OSMesa offers no OpenGL 3.3 core context. Use the Embree renderer.");
    if (osmesa().make_current(context_, pixels_.data(), GL_UNSIGNED_BYTE, width, height) == GL_FALSE) {
      osmesa().destroy(context_);
      throw InputError("OSMesa cannot draw " + std::to_string(width) + " x " + std::to_string(height) +
                       " pixels. Use a smaller picture or the Embree renderer.");
    }
    osmesa().pixel_store(OSMESA_Y_UP, 0);
  }
  ~OsmesaContext() override {
    osmesa().make_current(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0);
    osmesa().destroy(context_);
  }
  OsmesaContext(const OsmesaContext&) = delete;
  OsmesaContext& operator=(const OsmesaContext&) = delete;

  void* function(const char* name) const override { return reinterpret_cast<void*>(osmesa().address(name)); }
  const std::vector<std::uint8_t>& finish() override {
    reinterpret_cast<void (*)()>(function("glFinish"))();
    return pixels_;
  }

 private:
  std::vector<std::uint8_t> pixels_;
  OSMesaContext context_;
};

}  // namespace

std::unique_ptr<GlContext> make_osmesa_context(int width, int height) {
  GLint most_columns = 0;
  GLint most_rows = 0;
  osmesa().integer(OSMESA_MAX_WIDTH, &most_columns);
  osmesa().integer(OSMESA_MAX_HEIGHT, &most_rows);
  if (width > most_columns || height > most_rows) {
    throw InputError("OSMesa draws at most " + std::to_string(most_columns) + " x " +
                     std::to_string(most_rows) + " pixels; got " + std::to_string(width) + " x " +
                     std::to_string(height) +
                     ", samples counted. Use a smaller picture or the Embree renderer.");
  }
  return std::make_unique<OsmesaContext>(width, height);
}

}  // namespace anticrack
