#pragma once
/// Everything that reads a file from elsewhere, as functions of the file's bytes.

#include <span>
#include <string>

namespace fuzz {

struct Reader {
    const char* name;
    /// Reads the bytes as a file. Returns, or throws io::InputError; anything else is a defect.
    void (*read)(const std::string& bytes);
};

std::span<const Reader> readers();
/// Null where there is none of that name.
const Reader* find_reader(const std::string& name);

/// True where the reader took the bytes, false where it refused them with a message that can be shown: not
/// empty, at most 100 000 bytes, without control characters but the ends of its lines, and without names of
/// libraries that this program uses. Throws
/// std::logic_error for another message, and lets every other exception through.
bool accepts(const Reader&, const std::string& bytes);

}  // namespace fuzz
