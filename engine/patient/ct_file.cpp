#include <algorithm>
#include <fmt/format.h>

#include "engine/io/files.h"
#include "engine/patient/ct_samples.h"
#include "engine/patient/patient_files.h"
#include "physics/geometry/hash.h"

namespace patient {
namespace {

namespace fs = std::filesystem;

const char* const accepted_cts =
    "expected NIfTI (.nii, .nii.gz), NRRD (.nrrd, .nhdr) or a folder of DICOM files";

bool is_nrrd(const fs::path& path) {
    return path.extension() == ".nrrd" || path.extension() == ".nhdr";
}

void add_file(geometry::Hash& hash, const fs::path& path) {
    io::require_no_device(path);
    std::ifstream file(path, std::ios::binary);
    std::error_code failed;
    hash.add(std::uint64_t{fs::file_size(path, failed)});
    if (failed || !file) refuse_ct(path, "no such file can be read", accepted_cts);
    std::vector<char> bytes(1 << 20);
    while (file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())) || file.gcount() > 0)
        hash.add(bytes.data(), static_cast<std::size_t>(file.gcount()));
}

}  // namespace

CtImage read_ct(const fs::path& path, const std::string& series, const Progress& progress) {
    io::require_no_device(path);
    std::error_code failed;
    CtImage ct;
    try {
        if (fs::is_directory(path, failed)) {
            ct = read_dicom(path, series, progress);
        } else if (!fs::is_regular_file(path, failed)) {
            refuse_ct(path, "no such CT can be read", accepted_cts);
        } else if (!series.empty()) {
            refuse_ct(path, fmt::format("a file was found with series = \"{}\"", series),
                      "expected 'series' only with a folder of DICOM files");
        } else if (is_nrrd(path)) {
            ct = read_nrrd(path, progress);
        } else if (path.filename().string().ends_with(".nii") ||
                   path.filename().string().ends_with(".nii.gz")) {
            ct = read_nifti(path, progress);
        } else {
            refuse_ct(path, "a file of another kind was found", accepted_cts);
        }
    } catch (const fs::filesystem_error& error) {
        refuse_ct(path, error.code().message(), accepted_cts);
    } catch (const std::bad_alloc&) {
        refuse_ct(path, "there is not enough memory for its samples", "expected a smaller CT");
    }
    require_hounsfield(path, ct.hu);
    return ct;
}

std::vector<fs::path> inputs_of(const PatientFiles& files) {
    std::vector<fs::path> all;
    if (!files.ct.empty()) {
        all.push_back(files.ct);
        std::error_code ignored;
        if (fs::is_regular_file(files.ct, ignored) && is_nrrd(files.ct))
            if (const auto data = detached_data(files.ct)) all.push_back(*data);
    }
    for (const PatientMesh& mesh : files.meshes) all.push_back(mesh.file);
    return all;
}

std::uint64_t content_hash(const fs::path& path) {
    geometry::Hash hash;
    io::require_no_device(path);
    std::error_code failed;
    if (fs::is_directory(path, failed)) {
        std::vector<fs::path> files;
        try {
            for (const auto& entry : fs::recursive_directory_iterator(path))
                if (entry.is_regular_file()) files.push_back(entry.path());
        } catch (const fs::filesystem_error& error) {
            refuse_ct(path, error.code().message(), accepted_cts);
        }
        std::ranges::sort(files);
        hash.add(std::uint64_t{files.size()});
        for (const fs::path& file : files) add_file(hash, file);
        return hash.value();
    }
    if (!fs::is_regular_file(path, failed)) refuse_ct(path, "no such file can be read", accepted_cts);
    add_file(hash, path);
    if (is_nrrd(path))
        if (const auto data = detached_data(path)) add_file(hash, *data);
    return hash.value();
}

}  // namespace patient
