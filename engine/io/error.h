#pragma once
/// What the outside world did wrong: files, folders, arguments. A bug of a caller is an assert, never this.

#include <stdexcept>
#include <string>

namespace io {

/// what() is one problem a line, each `file:line:column: what was found; what is accepted` as far as known.
class InputError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// A place in a text that a person wrote; line and column count from 1, 0 = not known.
struct TextPlace {
    std::string file;
    int line = 0, column = 0;
};

/// `file:line:column: message`, leaving out what is not known.
std::string located(const TextPlace&, const std::string& message);

}  // namespace io
