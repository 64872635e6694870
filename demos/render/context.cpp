#include "render/context.h"

#include <dlfcn.h>

#include <array>
#include <stdexcept>

#include "render/gl_api.h"

namespace penalty::render {
namespace {

class Library {
 public:
  explicit Library(const std::vector<std::string>& names) {
    for (const std::string& name : names) {
      handle_ = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
      if (handle_) return;
    }
    throw std::runtime_error("cannot load " + (names.empty() ? std::string("any library") : names.front()));
  }
  // Never dlclose'd: Mesa and LLVM leave exit handlers behind that would point into unmapped code.

  template <class Function>
  Function* symbol(const char* name) const {
    void* address = dlsym(handle_, name);
    if (!address) throw std::runtime_error(std::string("no symbol ") + name);
    return reinterpret_cast<Function*>(address);
  }

 private:
  void* handle_ = nullptr;
};

/// OSMesa's C interface is frozen and five functions wide, so that its header is not needed.
class OsmesaPlatform final : public Platform {
 public:
  explicit OsmesaPlatform(const std::vector<std::string>& libraries) : library_(libraries) {
    constexpr int format = 0x22, rgba = 0x1908, profile = 0x33, core = 0x34, major = 0x36, minor = 0x37;
    const std::array<int, 9> attributes{format, rgba, profile, core, major, 3, minor, 3, 0};
    make_current_ = library_.symbol<unsigned char(void*, void*, unsigned, int, int)>("OSMesaMakeCurrent");
    find_ = library_.symbol<void*(const char*)>("OSMesaGetProcAddress");
    destroy_ = library_.symbol<void(void*)>("OSMesaDestroyContext");
    context_ = library_.symbol<void*(const int*, void*)>("OSMesaCreateContextAttribs")(attributes.data(), nullptr);
    if (!context_) throw std::runtime_error("no OpenGL 3.3 core context");
  }
  ~OsmesaPlatform() override { destroy_(context_); }

  std::string_view name() const override { return "osmesa"; }
  void make_current() override {
    // A dummy colour buffer: everything is drawn into framebuffer objects.
    if (!make_current_(context_, buffer_.data(), GL_UNSIGNED_BYTE, buffer_side, buffer_side))
      throw std::runtime_error("OSMesa cannot make its context current");
  }
  void release() override { make_current_(nullptr, nullptr, 0, 0, 0); }
  void* find(const char* function) override { return find_(function); }

 private:
  static constexpr int buffer_side = 16;
  Library library_;
  void* context_ = nullptr;
  unsigned char (*make_current_)(void*, void*, unsigned, int, int) = nullptr;
  void* (*find_)(const char*) = nullptr;
  void (*destroy_)(void*) = nullptr;
  std::array<unsigned char, 4 * buffer_side * buffer_side> buffer_{};
};

class EglPlatform final : public Platform {
 public:
  explicit EglPlatform(const std::vector<std::string>& libraries) : library_(libraries) {
    constexpr unsigned surfaceless = 0x31DD, opengl_api = 0x30A2;
    constexpr int major = 0x3098, minor = 0x30FB, profile = 0x30FD, core = 1, none = 0x3038;
    find_ = library_.symbol<void*(const char*)>("eglGetProcAddress");
    make_current_ = library_.symbol<unsigned(void*, void*, void*, void*)>("eglMakeCurrent");
    destroy_ = library_.symbol<unsigned(void*, void*)>("eglDestroyContext");
    const auto platform_display =
        reinterpret_cast<void* (*)(unsigned, void*, const int*)>(find_("eglGetPlatformDisplayEXT"));
    if (!platform_display) throw std::runtime_error("no eglGetPlatformDisplayEXT");
    display_ = platform_display(surfaceless, nullptr, nullptr);
    if (!display_) throw std::runtime_error("no surfaceless display (no Mesa driver?)");
    int version[2] = {0, 0};
    if (!library_.symbol<unsigned(void*, int*, int*)>("eglInitialize")(display_, &version[0], &version[1]))
      throw std::runtime_error("the surfaceless display does not initialise (no Mesa driver?)");
    library_.symbol<unsigned(unsigned)>("eglBindAPI")(opengl_api);
    const std::array<int, 7> attributes{major, 3, minor, 3, profile, core, none};
    context_ = library_.symbol<void*(void*, void*, void*, const int*)>("eglCreateContext")(display_, nullptr, nullptr,
                                                                                           attributes.data());
    if (!context_) throw std::runtime_error("no OpenGL 3.3 core context");
  }
  // The display is one for the whole process and not counted: eglTerminate would pull it from under other contexts.
  ~EglPlatform() override { destroy_(display_, context_); }

  std::string_view name() const override { return "egl"; }
  void make_current() override {
    if (!make_current_(display_, nullptr, nullptr, context_))
      throw std::runtime_error("EGL cannot make its context current");
  }
  void release() override { make_current_(display_, nullptr, nullptr, nullptr); }
  void* find(const char* function) override { return find_(function); }

 private:
  Library library_;
  void* display_ = nullptr;
  void* context_ = nullptr;
  void* (*find_)(const char*) = nullptr;
  unsigned (*make_current_)(void*, void*, void*, void*) = nullptr;
  unsigned (*destroy_)(void*, void*) = nullptr;
};

}  // namespace

Backend backend_from_name(std::string_view name) {
  if (name == "auto") return Backend::automatic;
  if (name == "osmesa") return Backend::osmesa;
  if (name == "egl") return Backend::egl;
  throw std::invalid_argument("unknown GL back end '" + std::string(name) + "': auto, osmesa or egl");
}

Context::Context(Backend backend, const BackendLibraries& libraries) {
  std::string answers;
  const auto attempt = [&]<class Candidate>(std::type_identity<Candidate>, Backend which, const char* label,
                                            const std::vector<std::string>& names) {
    if (platform_ || (backend != Backend::automatic && backend != which)) return;
    try {
      auto candidate = std::make_unique<Candidate>(names);
      candidate->make_current();
      gl_ = std::make_unique<GlApi>([found = candidate.get()](const char* function) { return found->find(function); });
      const auto text = [&](GLenum what) {
        const GLubyte* value = gl_->get_string(what);
        return std::string(value ? reinterpret_cast<const char*>(value) : "?");
      };
      description_ = text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
      candidate->release();
      platform_ = std::move(candidate);
    } catch (const std::exception& error) {
      answers += std::string(answers.empty() ? "" : "; ") + label + " said: " + error.what();
    }
  };
  attempt(std::type_identity<OsmesaPlatform>{}, Backend::osmesa, "osmesa", libraries.osmesa);
  attempt(std::type_identity<EglPlatform>{}, Backend::egl, "egl", libraries.egl);
  if (!platform_)
    throw std::runtime_error("no off-screen OpenGL: install libegl1 and libgl1-mesa-dri, or libosmesa6 (" + answers +
                             ")");
}

Context::~Context() = default;

}  // namespace penalty::render
