#pragma once
/// Errors of the outside world: files, folders, arguments. A caller's bug is an assert, never one of these.

#include <fmt/format.h>
#include <stdexcept>
#include <string>
#include <utility>

namespace io {

/// The text as a terminal may show it: at most 100 lines of at most 1000 bytes, without control characters,
/// which a file may have brought along; what is left out is counted.
std::string printable(const std::string&);

/// what() is printable and has one problem per line, each `file:line:column: what was found; what is
/// accepted` as far as known.
class InputError : public std::runtime_error {
public:
    explicit InputError(const std::string& what) : std::runtime_error(printable(what)) {}
    template <class First, class... Others>
    InputError(fmt::format_string<First, Others...> what, First&& first, Others&&... others)
        : InputError(fmt::format(what, std::forward<First>(first), std::forward<Others>(others)...)) {}
};

/// A place in a text written by a person; line and column count from 1, 0 = not known.
struct TextPlace {
    std::string file;
    int line = 0, column = 0;
};

/// `file:line:column: message`, omitting what is not known.
std::string located(const TextPlace&, const std::string& message);

}  // namespace io
