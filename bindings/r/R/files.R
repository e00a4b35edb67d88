# Files between R and the program: shapes as JSON, records, tables and arrays.

json_string <- function(text) {
  if (length(text) == 0) return(character())
  vapply(enc2utf8(as.character(text)), function(each) as.character(jsonlite::toJSON(each, auto_unbox = TRUE)), "",
         USE.NAMES = FALSE)
}

# 17 digits say which double it is; jsonlite writes 15.
json_number <- function(x) ifelse(is.na(x), "null", sprintf("%.17g", x))

json_points <- function(points) {
  rows <- apply(matrix(json_number(points), nrow(points)), 1, paste, collapse = ",")
  paste0("[", paste0("[", rows, "]", collapse = ","), "]")
}

write_shapes <- function(shapes, path) {
  texts <- vapply(seq_along(shapes$points), function(i) {
    points <- shapes$points[[i]]
    labels <- rownames(points)
    paste0("{", if (!is.null(shapes$names)) paste0("\"name\":", json_string(shapes$names[i]), ","),
           if (!is.null(labels)) paste0("\"labels\":[", paste(json_string(labels), collapse = ","), "],"),
           # As geomorph reads and R draws them.
           if (ncol(points) == 2) "\"y_down\":false,",
           "\"points\":", json_points(points), "}")
  }, "")
  text <- paste0("{\"shapes\":[\n", paste(texts, collapse = ",\n"), "\n]}\n")
  connection <- file(path, "wb")
  on.exit(close(connection))
  writeBin(charToRaw(text), connection)
  path
}

read_record <- function(path) {
  size <- file.info(path)$size
  text <- readBin(path, "raw", size)
  text <- rawToChar(text)
  Encoding(text) <- "UTF-8"
  list(text = text, values = jsonlite::fromJSON(text))
}

# R's own as.numeric() is off by a bit for some numbers of 17 digits; the parser of JSON is not.
exact_numbers <- function(text) {
  known <- !is.na(text)
  numbers <- rep(NA_real_, length(text))
  if (any(known)) numbers[known] <- as.numeric(jsonlite::fromJSON(paste0("[", paste(text[known], collapse = ","), "]")))
  numbers
}

text_columns <- c("specimen", "label", "name", "folder", "group", "source", "kind", "noise", "asked", "first", "second",
                  "detail", "error", "landmarks", "number", "model", "term", "coefficient")
# A table of the program: texts, numbers to the last digit, and TRUE for 1 in the columns `truths`.
read_table <- function(path, truths = character()) {
  lines <- readLines(path, encoding = "UTF-8", warn = FALSE)
  skip <- if (length(lines) > 0 && startsWith(lines[1], "#")) 1 else 0
  table <- read.csv(path, check.names = FALSE, encoding = "UTF-8", comment.char = "", colClasses = "character",
                    na.strings = c("NA", ""), skip = skip)
  for (name in setdiff(names(table), text_columns)) {
    value <- table[[name]]
    if (!all(is.na(value) | grepl("^-?[0-9]+([.][0-9]+)?([eE][-+]?[0-9]+)?$", value))) next
    table[[name]] <- exact_numbers(value)
    if (name %in% truths) table[[name]] <- table[[name]] == 1
  }
  table
}

# The names of a file's rows that are no rows of R.
tidy <- function(table) {
  rownames(table) <- NULL
  table
}

# Rows of [landmark][axis] as a matrix, whatever of them is missing.
as_points <- function(value, labels = NULL) {
  number <- function(x) if (is.null(x)) NA else x
  if (is.list(value))
    value <- do.call(rbind, lapply(value, function(row) as.numeric(unlist(lapply(row, number)))))
  points <- matrix(as.numeric(value), nrow = NROW(value))
  dimnames(points) <- list(if (length(labels) == nrow(points)) labels, axis_names(ncol(points)))
  points
}

axis_names <- function(k) c("X", "Y", "Z")[seq_len(k)]

# An array of numpy in the order of R: the axes are reversed in memory.
read_npy <- function(path) {
  connection <- file(path, "rb")
  on.exit(close(connection))
  magic <- readBin(connection, "raw", 8)
  if (length(magic) < 8 || !identical(rawToChar(magic[2:6]), "NUMPY"))
    raise("program_error", sprintf("%s is no array of numpy", path))
  length_of_header <- readBin(connection, "integer", 1, size = if (magic[7] == as.raw(1)) 2 else 4, signed = FALSE,
                              endian = "little")
  header <- rawToChar(readBin(connection, "raw", length_of_header))
  if (!grepl("'<f8'", header, fixed = TRUE) || !grepl("'fortran_order': False", header, fixed = TRUE))
    raise("program_error", sprintf("%s is no array of doubles by rows", path))
  shape <- sub(".*'shape': *\\(([^)]*)\\).*", "\\1", header)
  sizes <- as.integer(strsplit(gsub(" ", "", shape), ",")[[1]])
  values <- readBin(connection, "double", prod(sizes), endian = "little")
  aperm(array(values, rev(sizes)))
}
