#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>

#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/patient/ct_samples.h"
#include "engine/patient/dicom_file.h"
#include "engine/patient/patient_files.h"
#include "physics/geometry/hash.h"

namespace patient {
namespace {

namespace fs = std::filesystem;

const char* const accepted_cts =
    "expected NIfTI (.nii, .nii.gz, .hdr with .img), NRRD (.nrrd, .nhdr), MetaImage (.mha, .mhd) or a folder "
    "of DICOM files";

enum class Format { None, Nifti, Nrrd, MetaImage };

Format format_of(const fs::path& path) {
    const std::string name = io::lower_case(path.filename().string());
    const auto ends = [&](std::initializer_list<const char*> endings) {
        return std::ranges::any_of(endings, [&](const char* ending) { return name.ends_with(ending); });
    };
    if (ends({".nii", ".nii.gz", ".hdr", ".img", ".hdr.gz", ".img.gz"})) return Format::Nifti;
    if (ends({".nrrd", ".nhdr"})) return Format::Nrrd;
    if (ends({".mha", ".mhd"})) return Format::MetaImage;
    return Format::None;
}

/// Files besides that the samples of this one lie in.
std::vector<fs::path> data_files(const fs::path& path) {
    switch (format_of(path)) {
        case Format::Nifti:
            return nifti_data_files(path);
        case Format::Nrrd:
            return nrrd_data_files(path);
        case Format::MetaImage:
            return metaimage_data_files(path);
        case Format::None:
            break;
    }
    return {};
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

namespace {

CtImage read_ct_here(const fs::path& path, const std::string& series, const Progress& progress) {
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
        } else if (format_of(path) == Format::Nrrd) {
            ct = read_nrrd(path, progress);
        } else if (format_of(path) == Format::Nifti) {
            ct = read_nifti(path, progress);
        } else if (format_of(path) == Format::MetaImage) {
            ct = read_metaimage(path, progress);
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

LabelImage read_labels_here(const fs::path& path, const Progress& progress) {
    try {
        switch (format_of(path)) {
            case Format::Nrrd:
                return read_nrrd_labels(path, progress);
            case Format::Nifti:
                return read_nifti_labels(path, progress);
            case Format::MetaImage:
                return read_metaimage_labels(path, progress);
            default:
                return read_dicom_labels(path, progress);
        }
    } catch (const std::bad_alloc&) {
        refuse_ct(path, "there is not enough memory for its samples", "expected a smaller mask");
    }
}

/// Grids and samples may be any where a file has taken over the process that read it.
void require_as_many(const render::VolumeGrid& grid, std::size_t layers, std::size_t samples) {
    for (const int size : grid.size)
        if (size < 1 || size > 32768) throw std::logic_error("a reader returned a grid of no size");
    if (layers < 1 || layers > 32768 || grid.count() > most_samples || samples != grid.count() * layers)
        throw std::logic_error("a reader returned another number of samples than its grid has");
}

}  // namespace

CtImage read_ct(const fs::path& path, const std::string& series, const Progress& progress) {
    io::require_no_device(path);
    CtImage ct = io::read_behind_wall(
        path, progress, [&](const Progress& told) { return read_ct_here(path, series, told); },
        [](geometry::StateStream& s, CtImage& image) {
            s(image.grid.origin, image.grid.steps, image.grid.size, image.hu, image.notes,
              image.frame_of_reference);
        });
    require_as_many(ct.grid, 1, ct.hu.size());
    return ct;
}

bool is_label_file(const fs::path& path) {
    if (format_of(path) != Format::None || io::lower_case(path.extension().string()) == ".dcm") return true;
    std::error_code failed;
    return fs::is_regular_file(path, failed) && is_dicom_file(path);  // a FIFO is not opened
}

LabelImage read_labels(const fs::path& path, const Progress& progress) {
    io::require_no_device(path);
    std::error_code failed;
    if (!fs::is_regular_file(path, failed) || !is_label_file(path))
        refuse_ct(path,
                  fs::exists(path, failed) ? "a file of another kind was found" : "no such mask can be read",
                  "expected a mask as NIfTI (.nii, .nii.gz, .hdr with .img), NRRD (.nrrd, .seg.nrrd), "
                  "MetaImage (.mha, .mhd) or DICOM SEG (.dcm)");
    LabelImage labels = io::read_behind_wall(
        path, progress, [&](const Progress& told) { return read_labels_here(path, told); },
        [](geometry::StateStream& s, LabelImage& image) {
            s(image.grid.origin, image.grid.steps, image.grid.size, image.layers, image.values, image.names,
              image.fractions, image.notes, image.frame_of_reference, image.only_marked);
        });
    require_as_many(labels.grid, static_cast<std::size_t>(std::max(labels.layers, 0)), labels.values.size());
    return labels;
}

std::vector<fs::path> inputs_of(const PatientFiles& files) {
    std::vector<fs::path> all;
    if (!files.ct.empty()) {
        all.push_back(files.ct);
        std::error_code ignored;
        if (fs::is_regular_file(files.ct, ignored))
            for (fs::path& data : data_files(files.ct)) all.push_back(std::move(data));
    }
    for (const PatientMesh& mesh : files.meshes) all.push_back(mesh.file);
    return all;
}

namespace {

void add_files_below(const fs::path& folder, std::vector<fs::path>& files,
                     std::vector<fs::path>& links_to_nothing) {
    constexpr std::size_t most = 20'000;
    std::error_code failed;
    const auto require = [&failed](const fs::path& path) {
        if (failed) refuse_ct(path, failed.message(), "expected files and folders that can be read");
    };
    fs::directory_iterator entries(folder, failed);
    require(folder);
    for (const fs::directory_iterator end; entries != end; entries.increment(failed), require(folder)) {
        const fs::file_status found = entries->status(failed);
        if (failed == std::errc::no_such_file_or_directory) {
            links_to_nothing.push_back(entries->path());
            continue;
        }
        require(entries->path());
        std::error_code ignored;
        if (fs::is_regular_file(found)) files.push_back(entries->path());
        if (files.size() > most)
            refuse_ct(folder, fmt::format("more than {} files were found", most),
                      "expected the folder of one examination");
        if (fs::is_directory(found) && !entries->is_symlink(ignored))
            add_files_below(entries->path(), files, links_to_nothing);
    }
}

}  // namespace

std::vector<fs::path> files_below(const fs::path& folder, std::vector<fs::path>* links_to_nothing) {
    std::vector<fs::path> files, links;
    add_files_below(folder, files, links);
    std::ranges::sort(files);
    std::ranges::sort(links);
    if (links_to_nothing) *links_to_nothing = std::move(links);
    return files;
}

std::uint64_t content_hash(const fs::path& path) {
    geometry::Hash hash;
    io::require_no_device(path);
    std::error_code failed;
    if (fs::is_directory(path, failed)) {
        const std::vector<fs::path> files = files_below(path);
        hash.add(std::uint64_t{files.size()});
        for (const fs::path& file : files) add_file(hash, file);
        return hash.value();
    }
    if (!fs::is_regular_file(path, failed)) refuse_ct(path, "no such file can be read", accepted_cts);
    add_file(hash, path);
    for (const fs::path& data : data_files(path)) add_file(hash, data);
    return hash.value();
}

}  // namespace patient
