# Shapes: the p x k x n arrays of geomorph, shapes and Morpho, and what else holds landmarks in R.

# What `x` holds as list(points = list of p x k matrices, names, kind): `kind` says how to give results back.
# @param what the argument, for messages
as_shapes <- function(x, what) {
  refuse <- function(...) raise("input_error", paste0(what, ": ", sprintf(...)))
  if (inherits(x, "pulson_atlas")) x <- x$template
  if (is.list(x) && !is.data.frame(x)) {
    held <- Find(function(name) is.numeric(x[[name]]) || is.data.frame(x[[name]]),
                 c("coords", "shape", "landmarks", "Shape", "land", "A"))
    if (!is.null(held)) return(as_shapes(x[[held]], paste0(what, "$", held)))
    frames <- vapply(x, is.data.frame, NA)
    x[frames] <- lapply(x[frames], frame_matrix, what)
    if (length(x) > 0 && all(vapply(x, function(each) is.numeric(each) && is.matrix(each), NA)))
      return(shapes_of_list(x, what))
    if (length(x) == 0) refuse("it is empty")
    refuse("a list of %s holds no landmarks; a p x k x n array, a list of p x k matrices, or a list with one as $coords, $shape or $landmarks is needed",
           if (is.null(names(x))) class(x[[1]])[1] else paste(names(x), collapse = ", "))
  }
  if (is.data.frame(x)) {
    if (is_long(x)) return(shapes_of_long(x, what))
    x <- frame_matrix(x, what)
  }
  if (is.complex(x)) return(shapes_of_complex(x, what))
  if (!is.numeric(x)) refuse("numbers are needed, and it is of the class %s", class(x)[1])
  if (any(is.infinite(x))) refuse("a coordinate is infinite; NA marks a missing landmark")
  sizes <- dim(x)
  if (length(sizes) < 2) return(as_shapes(matrix(x, ncol = 1, dimnames = list(names(x), NULL)), what))
  if (any(sizes == 0)) refuse("it is empty (%s)", paste(sizes, collapse = " x "))
  if (length(sizes) == 2) {
    check_axes(sizes, what)
    return(list(points = list(plain_points(x)), names = NULL, kind = "matrix"))
  }
  if (length(sizes) != 3)
    refuse("it has %d dimensions; a p x k x n array (landmarks, axes, specimens) is needed", length(sizes))
  check_axes(sizes, what)
  names <- dimnames(x)[[3]]
  if (is.null(names)) names <- as.character(seq_len(sizes[3]))
  labels <- dimnames(x)[[1]]
  points <- lapply(seq_len(sizes[3]), function(i)
    plain_points(matrix(x[, , i], sizes[1], sizes[2], dimnames = list(labels, NULL))))
  list(points = points, names = names, kind = "array")
}

# Row names that are all integers are the numbers of rows, as a part of a data frame has them, and no names of landmarks.
plain_points <- function(x) {
  labels <- rownames(x)
  storage.mode(x) <- "double"
  if (!any(nzchar(labels)) || all(grepl("^[0-9]*$", labels))) labels <- NULL
  matrix(x, nrow(x), ncol(x), dimnames = list(labels, NULL))
}

frame_matrix <- function(x, what) {
  numeric <- vapply(x, is.numeric, NA)
  hint <- "; a table of specimens and landmarks has the coordinates in columns x, y and z"
  if (!all(numeric)) raise("input_error", sprintf("%s: its column '%s' is no number%s", what, names(x)[!numeric][1], hint))
  told <- grepl("^(specimen|individual|ind|id|landmark|lm|point|label|name)s?$", names(x), ignore.case = TRUE)
  if (any(told)) raise("input_error", sprintf("%s: its column '%s' is no coordinate%s", what, names(x)[told][1], hint))
  as.matrix(x)
}

# A table with columns x and y, and others that say of which specimen and landmark they are: read as the program reads it.
is_long <- function(x) {
  axes <- tolower(names(x)) %in% c("x", "y", "z")
  any(axes) && !all(axes)
}

shapes_of_long <- function(x, what) {
  folder <- run_folder()
  on.exit(unlink(folder, recursive = TRUE))
  path <- file.path(folder, paste0(what, ".csv"))
  x[] <- lapply(x, function(column) if (is.numeric(column)) ifelse(is.na(column), NA, sprintf("%.17g", column))
                else enc2utf8(as.character(column)))
  write.csv(x, path, row.names = FALSE, fileEncoding = "UTF-8")
  held <- pulson_read(path)
  if (is.list(held) || dim(held)[3] > 1) return(as_shapes(held, what))
  as_shapes(matrix(held, dim(held)[1], dimnames = list(rownames(held), NULL)), what)
}

shapes_of_list <- function(x, what) {
  for (i in seq_along(x)) {
    name <- if (is.null(names(x))) paste0("[[", i, "]]") else paste0("$", names(x)[i])
    if (any(is.infinite(x[[i]]))) raise("input_error", paste0(what, name, ": a coordinate is infinite"))
    if (any(dim(x[[i]]) == 0)) raise("input_error", paste0(what, name, ": it is empty"))
    check_axes(dim(x[[i]]), paste0(what, name))
  }
  names <- names(x)
  if (is.null(names)) names <- as.character(seq_along(x))
  list(points = lapply(x, plain_points), names = names, kind = "list")
}

# Of the package shapes, in the plane: a configuration, or one in each column.
shapes_of_complex <- function(x, what) {
  x <- as.matrix(x)
  if (length(x) == 0) raise("input_error", paste0(what, ": it is empty"))
  points <- lapply(seq_len(ncol(x)), function(i) {
    one <- cbind(Re(x[, i]), Im(x[, i]))
    rownames(one) <- rownames(x)
    plain_points(one)
  })
  if (ncol(x) == 1) return(list(points = points, names = NULL, kind = "matrix"))
  names <- if (is.null(colnames(x))) as.character(seq_len(ncol(x))) else colnames(x)
  list(points = points, names = names, kind = "array")
}

# Landmarks, axes, specimens; others are named with the call that puts them in order.
check_axes <- function(sizes, what) {
  is_axes <- function(size) size %in% 1:3
  if (is_axes(sizes[2])) return(invisible())
  refuse <- function(...) raise("input_error", paste0(what, ": ", sprintf(...)))
  text <- paste(sizes, collapse = " x ")
  if (length(sizes) == 2 && is_axes(sizes[1]))
    refuse("it is %s, axes by landmarks; landmarks are rows: t(%s)", text, what)
  if (length(sizes) == 3 && is_axes(sizes[1]))
    refuse("it is %s, axes first; p x k x n is needed (landmarks, axes, specimens): aperm(%s, c(2, 1, 3))", text, what)
  if (length(sizes) == 3 && is_axes(sizes[3]))
    refuse("it is %s, axes last; p x k x n is needed (landmarks, axes, specimens): aperm(%s, c(2, 3, 1))", text, what)
  if (length(sizes) == 2 && sizes[2] %% 2 == 0)
    refuse("it is %s: a specimen in each row, it seems; an array of them is geomorph::arrayspecs(%s, %d, 2)", text, what,
           sizes[2] %/% 2)
  refuse("it is %s; p x k or p x k x n is needed, of k = 1, 2 or 3 axes", text)
}

# Matrices of one size as a p x k x n array.
as_array <- function(points, names, labels = rownames(points[[1]])) {
  sizes <- dim(points[[1]])
  array(unlist(lapply(points, as.vector)), c(sizes, length(points)),
        list(labels, axis_names(sizes[2]), names))
}

# Results in the form of what was given: a matrix, a list or an array, with its dimnames.
like_input <- function(points, input, shapes) {
  if (shapes$kind == "matrix") {
    result <- points[[1]]
    if (is.matrix(input) && !is.complex(input) && identical(dim(result), dim(input))) dimnames(result) <- dimnames(input)
    return(result)
  }
  if (shapes$kind == "list") {
    if (is.data.frame(input)) return(setNames(points, shapes$names))
    for (i in seq_along(points))
      dimnames(points[[i]]) <- if (is.data.frame(input[[i]])) dimnames(as.matrix(input[[i]])) else dimnames(input[[i]])
    return(setNames(points, names(input)))
  }
  result <- as_array(points, shapes$names)
  if (is.numeric(input) && identical(dim(result), dim(input))) dimnames(result) <- dimnames(input)
  result
}

# A file of the shapes in `folder`, or the address of a file that is the user's.
shape_argument <- function(x, what, folder) {
  if (is.character(x)) {
    if (length(x) == 0 || anyNA(x)) raise("input_error", sprintf("%s: the name of a file is needed", what))
    x <- path.expand(x)
    path <- sub("#[^#]*$", "", x)
    missing <- !file.exists(path) & !file.exists(x)
    if (any(missing)) raise("input_error", sprintf("%s: there is no file '%s'", what, x[missing][1]))
    address <- ifelse(file.exists(x), normalizePath(x, mustWork = FALSE),
                      paste0(normalizePath(path, mustWork = FALSE), substring(x, nchar(path) + 1)))
    return(list(words = address, shapes = NULL))
  }
  shapes <- as_shapes(x, what)
  if (shapes$kind == "list") file.create(file.path(folder, paste0(what, ".list")))  # for messages
  # Of a file with several shapes, or of one without names, the file names the shape.
  list(words = write_shapes(shapes, file.path(folder, paste0(what, ".json"))), shapes = shapes)
}

centroid_size <- function(shapes) {
  held <- as_shapes(shapes, "shapes")
  sizes <- vapply(held$points, function(points) {
    known <- points[stats::complete.cases(points), , drop = FALSE]
    sqrt(sum(sweep(known, 2, colMeans(known))^2))
  }, 0)
  setNames(sizes, held$names)
}

pulson_read <- function(file, ...) {
  folder <- run_folder()
  on.exit(unlink(folder, recursive = TRUE))
  out <- file.path(folder, "shapes.json")
  if (!is.character(file))
    raise("input_error", sprintf("file: the name of a file is needed, and it is of the class %s", class(file)[1]))
  run_program(c("convert", shape_argument(file, "file", folder)$words, paste0("--out=", out),
                option_words(list(...), "convert")), folder)
  shapes_of_file(out)
}

# Of a file in JSON: an array, or a list where the shapes differ in their number of landmarks.
shapes_of_file <- function(path) {
  held <- jsonlite::fromJSON(read_record(path)$text, simplifyDataFrame = FALSE)$shapes
  points <- lapply(held, function(shape) as_points(shape$points, shape$labels))
  names <- vapply(held, function(shape) if (is.null(shape$name)) "" else shape$name, "")
  if (length(unique(lapply(points, dim))) == 1) {
    if (!any(nzchar(names))) names <- NULL
    return(as_array(points, names))
  }
  setNames(points, names)
}

pulson_write <- function(shapes, file, ...) {
  one_file(file, "file")
  folder <- run_folder()
  on.exit(unlink(folder, recursive = TRUE))
  out <- file.path(normalizePath(dirname(file), mustWork = FALSE), basename(file))
  run_program(c("convert", shape_argument(shapes, "shapes", folder)$words, paste0("--out=", out),
                option_words(list(...), "convert")), folder)
  invisible(file)
}
