// Reads a picture, by the installed package.

#include <pulson/images/image.hpp>

int main(int argc, char** argv) { return argc > 1 && pulson::images::read_image(argv[1]).width() > 1 ? 0 : 1; }
