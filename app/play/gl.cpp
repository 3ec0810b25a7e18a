#include "app/play/gl.h"

#include <string>
#include <type_traits>

#include "engine/io/error.h"

namespace app {

Gl::Gl() {
    const auto find = [](auto& function, const char* name) {
        function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(glfwGetProcAddress(name));
        if (!function)
            throw io::InputError(std::string("the display's OpenGL has no ") + name + "; expected 3.3");
    };
#define SELDINGER_GL_FIND(type, name) find(name, "gl" #name);
    SELDINGER_GL_FUNCTIONS(SELDINGER_GL_FIND)
#undef SELDINGER_GL_FIND
}

}  // namespace app
