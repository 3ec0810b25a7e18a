#include "engine/run/output_folder.h"

#include <fmt/format.h>
#include <vector>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/run/angiogram_folder.h"
#include "engine/run/frame_sink.h"
#include "engine/run/picture_file.h"

namespace run {
namespace {

namespace fs = std::filesystem;

bool same(const fs::path& a, const fs::path& b) {
    std::error_code error;
    return fs::equivalent(a, b, error) && !error;
}

bool make(const fs::path& folder) {
    std::error_code error;
    const bool made = fs::create_directories(folder, error);
    if (error || !fs::is_directory(folder, error)) {
        throw io::InputError(fmt::format("{}: the output folder cannot be made: {}", folder.string(),
                                         error ? error.message() : "a file is in its place"));
    }
    return made;
}

/// Whether the file is an angiogram or named frame_000123 with one of the endings that are written here.
bool is_of_a_frame(const fs::path& file) {
    const std::string name = file.filename().string(), stem = name.substr(0, frame_file_name(0).size() - 4);
    const std::string ending = name.substr(stem.size());
    if (is_angiogram_file_name(name)) return true;
    return frame_of_file_name(stem + ".png") >= 0 &&
           (ending == ".png" || ending == ".json" || ending == "_wire.png" || ending == "_catheter.png" ||
            ending == "_vessels.png");
}

void take_out(const fs::path& file) {
    std::error_code error;
    fs::remove(file, error);
    if (error)
        throw io::InputError(fmt::format("{}: cannot be replaced: {}", file.string(), error.message()));
}

}  // namespace

void refuse_to_overwrite(const fs::path& out, const fs::path& script,
                         const std::optional<fs::path>& expected) {
    if (same(out / "run.gw", script)) {
        throw io::InputError(
            fmt::format("{}: the run would overwrite its own commands; another output folder is accepted",
                        script.string()));
    }
    if (expected && (same(out, *expected) || same(out / "run.gw", *expected))) {
        throw io::InputError(
            fmt::format("{}: the run would overwrite what it is compared with; another output folder is "
                        "accepted",
                        expected->string()));
    }
}

OutputFolder::OutputFolder(fs::path path, Parts parts) : path_(std::move(path)) {
    made_ = make(path_);
    for (const char* name : {"run.gw", "score.json", "sheet.png"}) take_out(path_ / name);
    for (const fs::path& folder : {frames(), panel(), truth(), dicom()}) {
        std::vector<fs::path> old;
        std::error_code error;
        for (const auto& entry : fs::directory_iterator(folder, error))
            if (is_of_a_frame(entry.path())) old.push_back(entry.path());
        for (const fs::path& file : old) take_out(file);
    }
    if (parts.frames) make(frames());
    if (parts.panel) make(panel());
    if (parts.truth) make(truth());
    if (parts.dicom) make(dicom());
}

OutputFolder::~OutputFolder() {
    if (kept_) return;
    std::error_code ignored;  // fs::remove takes only empty folders
    for (const fs::path& folder : {frames(), panel(), truth(), dicom()}) fs::remove(folder, ignored);
    if (made_) fs::remove(path_, ignored);
}

void OutputFolder::write_score(const std::string& json) const {
    io::write_whole(path_ / "score.json", json);
}

void OutputFolder::write_sheet(const render::GrayImage& page) const {
    write_picture(path_ / "sheet.png", page);
}

}  // namespace run
