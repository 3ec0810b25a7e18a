#pragma once
/// Where the room keeps attempts: each in a file of its own, none of which is ever replaced.

#include <filesystem>
#include <string>

namespace room {

class Attempts {
public:
    /// Keeps none.
    Attempts() = default;
    /// `wanted` names a folder, which is made when the first attempt is kept, or the file of the first
    /// attempt: a name with an extension where there is no folder. In a folder the attempts at `renal` are
    /// renal-001.gw, renal-002.gw and so on; those after my.gw are my-2.gw, my-3.gw and so on.
    explicit Attempts(std::filesystem::path wanted);

    bool kept() const { return !wanted_.empty(); }
    const std::filesystem::path& wanted() const { return wanted_; }
    /// Throws io::InputError where no attempt could be kept now. Leaves nothing behind.
    void require_writable() const;
    /// Makes the empty file of the next attempt, numbered after all that are there, also where several
    /// programs share the folder. Throws io::InputError.
    std::filesystem::path make_next(const std::string& scenario) const;

private:
    bool in_folder() const;

    std::filesystem::path wanted_;
};

}  // namespace room
