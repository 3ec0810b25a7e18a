#pragma once
/// The scenario that an author begins with.

#include <filesystem>
#include <string>

namespace author {

/// A commented scenario of that name: from the right groin into the aorta.
std::string starter(const std::string& name);

/// Another scenario as a beginning: its text with a title of its own; its benchmark stays with it, as it is
/// of another solution. Throws InputError where it names files beside it, as these would not be found from
/// `folder`.
std::string starter_from(const std::filesystem::path& scenario, const std::string& name,
                         const std::filesystem::path& folder, const std::filesystem::path& catalogue);

}  // namespace author
