# What the tests share. Each is skipped, with a word, where there is no program.
library(pulson)

if (!pulson_available()) {
  cat("skipped: the program pulson is not there; PULSON names it\n")
  quit(status = 0)
}

# The program's own results of files that R's own functions write: a second way to the same numbers.
program <- function(...) {
  words <- c(...)
  printed <- suppressWarnings(system2(pulson_program(), shQuote(words), stdout = TRUE, stderr = TRUE))
  code <- attr(printed, "status")
  list(code = if (is.null(code)) 0L else code, printed = as.character(printed))
}

record <- function(...) jsonlite::fromJSON(file.path(...))

# Numbers of a csv of the program, each as JSON has it.
column <- function(path, name) {
  text <- utils::read.csv(path, colClasses = "character", comment.char = "#", check.names = FALSE)[[name]]
  vapply(text, function(each) if (is.na(each)) NA_real_ else as.numeric(jsonlite::fromJSON(paste0("[", each, "]"))), 0,
         USE.NAMES = FALSE)
}

# A shape as a table with all digits.
write_csv <- function(points, path, name = NULL) {
  table <- as.data.frame(apply(points, 2, function(x) ifelse(is.na(x), "NA", sprintf("%.17g", x))))
  names(table) <- c("x", "y", "z")[seq_len(ncol(points))]
  if (!is.null(rownames(points))) table <- cbind(label = rownames(points), table)
  if (!is.null(name)) table <- cbind(specimen = name, table)
  table
}

write_cohort <- function(shapes, path) {
  tables <- lapply(seq_len(dim(shapes)[3]), function(i) write_csv(shapes[, , i], NULL, dimnames(shapes)[[3]][i]))
  utils::write.csv(do.call(rbind, tables), path, row.names = FALSE, fileEncoding = "UTF-8")
  path
}

same <- function(a, b, what = deparse(substitute(a))) {
  if (!identical(unname(as.vector(a)), unname(as.vector(b)))) {
    print(a)
    print(b)
    stop(what, " differs")
  }
}

fails <- function(expression, class, ...) {
  caught <- tryCatch({
    force(expression)
    NULL
  }, error = function(e) e)
  if (is.null(caught)) stop("no error where one is due")
  if (!inherits(caught, class)) stop("an error of another class: ", paste(class(caught), collapse = ", "), ": ",
                                     conditionMessage(caught))
  for (words in c(...))
    if (!grepl(words, conditionMessage(caught), fixed = TRUE))
      stop("'", conditionMessage(caught), "' does not say '", words, "'")
}

quietly <- function(expression) suppressMessages(suppressWarnings(expression))

leaves <- quietly(pulson_read(system.file("extdata", "leaves.tps", package = "pulson")))
