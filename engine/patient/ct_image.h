#pragma once
/// A CT of a patient, as files hold it: Hounsfield units on a grid, in the patient's coordinates; from
/// Hounsfield units to the materials in the beam, and back.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/io/wall.h"
#include "render/xray/volume.h"

namespace patient {

/// What scanners state at most (12 bits): values beyond are set to the nearer limit, metal among them.
inline constexpr int lowest_hu = -1024, highest_hu = 3071;
/// A CT of more samples is refused: it would need more than 2.4 GB of memory.
inline constexpr double most_samples = 6e8;

struct CtImage {
    render::VolumeGrid grid;       // in coordinates as of DICOM: +x left, +y back, +z head [mm]
    std::vector<std::int16_t> hu;  // i fastest, then j, then k
    // What was changed or left out since it lay in its file: a sentence each.
    std::vector<std::string> notes;
    std::string frame_of_reference = {};  // UID that DICOM gives the coordinates; else empty
};

using io::Progress;

/// Reads NIfTI (.nii, .nii.gz), NRRD (.nrrd, .nhdr) or a folder of DICOM files, behind a wall (io/wall.h).
/// `series`: for a folder that holds several, the UID of one or the beginning of its number or description.
/// Throws InputError for a file that is missing, damaged, of another kind, too large, or not a CT in a place.
CtImage read_ct(const std::filesystem::path&, const std::string& series = {}, const Progress& = {});

/// A volume of labels, as segmentation programs write it: which structure each voxel belongs to; 0 = none.
struct LabelImage {
    /// What the file calls a label.
    struct Name {
        int value = 1, layer = 0;
        std::string name;
        void state(geometry::StateStream& s) { s(value, layer, name); }
    };
    render::VolumeGrid grid;
    int layers = 1;                    // structures that may overlap lie in several
    std::vector<std::int16_t> values;  // layers of a voxel, then the next voxel, i fastest; rounded
    std::vector<Name> names;
    bool fractions = false;               // of the stored values, some were not whole
    std::vector<std::string> notes = {};  // of what was changed or taken, as those of a CT
    std::string frame_of_reference = {};  // as that of a CT
    bool only_marked =
        false;  // slices without marks were left out of the file: where the CT ends is not known
};

/// Reads NIfTI (.nii, .nii.gz), with the names that TotalSegmentator writes into it, NRRD (.nrrd, .nhdr,
/// Slicer's .seg.nrrd) or a segmentation of DICOM, behind a wall. Throws InputError as read_ct.
LabelImage read_labels(const std::filesystem::path&, const Progress& = {});
/// Whether the file is one that read_labels reads, by its name or DICOM's mark in it.
bool is_label_file(const std::filesystem::path&);

/// Energy at which a CT's numbers hold [keV]: an estimate of the mean of a 120 kV beam behind 200 mm of soft
/// tissue. Scanners differ by some keV, which changes bone by a few per cent and soft tissue by none.
inline constexpr double ct_energy = 70;

/// Hounsfield units of a material at that energy: 1000 (μ − μ_water)/(μ_water − μ_air), not rounded.
double hounsfield(render::Material);
/// The same of any attenuation at that energy [1/mm].
double hounsfield(double attenuation);

/// Fractions of the project's materials in air by Hounsfield units, which reproduce them at `ct_energy`.
/// Between air, lung, adipose, soft tissue and cortical bone each HU is a mixture of its two neighbours, as
/// in the interpolation of W. Schneider, T. Bortfeld and W. Schlegel, Phys. Med. Biol. 45:459–478 (2000);
/// above cortical bone its density grows. Trabecular bone is a mixture of cortical bone and soft tissue
/// already. The lines go on beyond what scanners state, below air as negative fractions: samples beside an
/// edge may go beyond it, see interpolate_means.
std::vector<render::VolumePart> materials_of_hounsfield();

}  // namespace patient
