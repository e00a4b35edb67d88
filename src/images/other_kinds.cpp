#include "images/other_kinds.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>

namespace pulson::images {
namespace {

using namespace std::string_view_literals;

struct Kind {
  std::size_t at;  ///< where in the file
  std::string_view magic;
  const char* name;
  const char* remedy;
};

constexpr const char* kAsPng = "save it as png or tif";
constexpr const char* kOfBioFormats = "save it as tif with ImageJ or Bio-Formats";
constexpr const char* kOfSlicer = "it holds a volume; save the slice as mha, nrrd or tif";

constexpr Kind kKinds[] = {
    {0, "GIF8"sv, "a gif picture", "save it as png, which keeps its palette, or an animated one as a tif of pages"},
    {8, "WEBP"sv, "a webp picture", kAsPng},
    {0, "\0\0\0\x0CjP  "sv, "a JPEG 2000 picture (jp2)", kAsPng},
    {0, "\xFF\x4F\xFF\x51"sv, "a JPEG 2000 picture (j2k)", kAsPng},
    {0, "\0\0\0\x0CJXL "sv, "a JPEG XL picture", kAsPng},
    {0, "\xFF\x0A"sv, "a JPEG XL picture", kAsPng},
    {4, "ftypavi"sv, "an avif picture", kAsPng},
    {4, "ftyphei"sv, "a heic picture, as of a phone", "save it as jpg, png or tif"},
    {4, "ftyphev"sv, "a heic picture, as of a phone", "save it as jpg, png or tif"},
    {4, "ftypmif1"sv, "a heic picture, as of a phone", "save it as jpg, png or tif"},
    {4, "ftypmsf1"sv, "a heic picture, as of a phone", "save it as jpg, png or tif"},
    {4, "ftypcrx"sv, "a raw photograph (cr3)", "develop it to tif or jpg"},
    {4, "ftyp"sv, "a film (mp4 or mov)", "save one picture of it as png"},
    {0, "FUJIFILMCCD-RAW"sv, "a raw photograph (raf)", "develop it to tif or jpg"},
    {0, "IIRO"sv, "a raw photograph (orf)", "develop it to tif or jpg"},
    {0, "IIU\0"sv, "a raw photograph (rw2)", "develop it to tif or jpg"},
    {0, "II\xBC\x01"sv, "a JPEG XR picture", kAsPng},
    {128, "DICM"sv, "a DICOM file", "save the slice as mha, nrrd or tif, as with 3D Slicer"},
    {344, "n+1\0"sv, "a NIfTI volume (nii)", kOfSlicer},
    {344, "ni1\0"sv, "the header of a NIfTI volume", kOfSlicer},
    {4, "n+2\0"sv, "a NIfTI volume (nii)", kOfSlicer},
    {0, "\x1F\x8B"sv, "compressed by gzip (as nii.gz and svgz)",
     "uncompress it; of a volume save the slice as mha or tif"},
    {0, "8BPS"sv, "a Photoshop file (psd)", kAsPng},
    {0, "gimp xcf"sv, "a GIMP file (xcf)", kAsPng},
    {0, "%PDF"sv, "a pdf", "save the picture in it as png"},
    {0, "%!PS"sv, "a PostScript file", kAsPng},
    {0, "\0\0\1\0"sv, "an icon (ico)", kAsPng},
    {0, "P7\n"sv, "a pam picture", kAsPng},
    {0, "PF\n"sv, "a pfm picture", "save it as tif, which holds floating-point numbers"},
    {0, "Pf\n"sv, "a pfm picture", "save it as tif, which holds floating-point numbers"},
    {0, "v/1\x01"sv, "an OpenEXR picture", "save it as tif, which holds floating-point numbers"},
    {0, "#?RADIANCE"sv, "a Radiance picture (hdr)", "save it as tif, which holds floating-point numbers"},
    {0, "SIMPLE  ="sv, "a fits file", "save it as tif, which holds floating-point numbers"},
    {0, "DDS "sv, "a dds picture", kAsPng},
    {0, "qoif"sv, "a qoi picture", kAsPng},
    {1, "HDF\r\n"sv, "an HDF5 file (as of ims, ilastik and BigDataViewer)", kOfBioFormats},
    {0, "\xDA\xCE\xBE\x0A"sv, "a microscope's file (nd2)", kOfBioFormats},
    {0, "ZISRAWFILE"sv, "a microscope's file (czi)", kOfBioFormats},
    {0, "p\0\0\0"sv, "a microscope's file (lif)", kOfBioFormats},
    {0, "\xD0\xCF\x11\xE0"sv, "a Microsoft compound file (as oib, zvi and doc)", kOfBioFormats},
    {1, "NUMPY"sv, "an array of numpy (npy)", "save it as tif, as with tifffile"},
    {0, "PK\x03\x04"sv, "a zip archive (as docx, xlsx and ora)", "unpack it, and give the picture in it"},
    {0, "Rar!"sv, "a rar archive", "unpack it, and give the picture in it"},
    {0, "7z\xBC\xAF"sv, "a 7z archive", "unpack it, and give the picture in it"},
};

/// A text that begins as svg or another page of marks does.
std::string kind_of_text(std::string_view bytes) {
  std::string start(bytes.substr(0, std::min<std::size_t>(bytes.size(), 1024)));
  std::transform(start.begin(), start.end(), start.begin(), [](unsigned char c) { return std::tolower(c); });
  if (start.find("<svg") != std::string::npos)
    return "a drawing (svg); save it as png, of as many pixels as the landmarks were placed on";
  if (start.find("<html") != std::string::npos || start.find("<!doctype html") != std::string::npos)
    return "a web page (html), as servers send it in place of a picture; download the picture itself";
  if (start.starts_with("version https://git-lfs"))
    return "a pointer of Git LFS and not the picture; fetch that by git lfs pull";
  return "";
}

}  // namespace

std::string other_kind(std::string_view bytes) {
  for (const Kind& kind : kKinds)
    if (bytes.size() > kind.at && bytes.substr(kind.at).starts_with(kind.magic))
      return std::string(kind.name) + ", which is not read; " + kind.remedy;
  return kind_of_text(bytes);
}

}  // namespace pulson::images
