#pragma once
/// What a command writes is neither what it reads nor written twice.

#include <filesystem>
#include <span>
#include <string>

namespace io {

/// A file that a command writes, and the option that asks for it, such as "--trace".
struct Output {
    std::string option;
    std::filesystem::path file;
};

/// The file that writing to the path would make or replace: links are followed, those to nothing too.
std::filesystem::path file_behind(const std::filesystem::path&);
/// Whether both are one file, there or yet to be made, under whatever names.
bool same_file(const std::filesystem::path&, const std::filesystem::path&);
/// To be called before any work. Throws InputError where an output is one of the inputs, a file that is there
/// below a folder among them, or another output.
void require_distinct(std::span<const Output> outputs, std::span<const std::filesystem::path> inputs);

}  // namespace io
