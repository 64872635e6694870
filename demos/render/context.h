// An off-screen OpenGL 3.3 core context: OSMesa (software, no driver) or EGL without a surface (software or a GPU).
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace penalty::render {

class GlApi;

/// `automatic` tries OSMesa first: its pixels do not depend on the machine's graphics card. Mesa removed OSMesa in
/// version 25.1: where it is gone, EGL takes over.
enum class Backend { automatic, osmesa, egl };

/// "auto", "osmesa" or "egl"; throws std::invalid_argument naming the three for anything else.
Backend backend_from_name(std::string_view name);

/// Shared libraries to try, in this order, for each back end.
struct BackendLibraries {
  std::vector<std::string> osmesa{"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"};
  std::vector<std::string> egl{"libEGL.so.1", "libEGL.so"};
};

/// What differs between the back ends: five entry points each.
class Platform {
 public:
  virtual ~Platform() = default;
  virtual std::string_view name() const = 0;
  virtual void make_current() = 0;
  virtual void release() = 0;
  virtual void* find(const char* function) = 0;
};

class Context {
 public:
  /// Throws std::runtime_error that names the packages to install and says what each back end answered.
  explicit Context(Backend backend, const BackendLibraries& libraries = {});
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const GlApi& gl() const { return *gl_; }
  std::string_view backend_name() const { return platform_->name(); }
  const std::string& description() const { return description_; }  // driver and version

  /// Current for the lifetime of this object, on this thread. Released afterwards, because OSMesa and EGL share Mesa's
  /// notion of the current context without telling each other.
  class Current {
   public:
    explicit Current(Context& context) : platform_(*context.platform_) { platform_.make_current(); }
    ~Current() { platform_.release(); }
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    Platform& platform_;
  };

 private:
  std::unique_ptr<Platform> platform_;
  std::unique_ptr<GlApi> gl_;
  std::string description_;
};

}  // namespace penalty::render
