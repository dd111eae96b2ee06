//! Refusals and warnings of imports with their Vietnamese texts.

/// Messages like those on pairs.
pub(super) const IMPORT_MESSAGES: &[(&str, &str)] = &[
    // Files of the rows of a list.
    (
        "mesh {} of {} is a link to a file that does not exist",
        "bản quét {0} của {1} là liên kết đến một tệp không tồn tại",
    ),
    (
        "mesh {} of {} does not exist",
        "không có bản quét {0} của {1}",
    ),
    (
        "mesh {} of {} is a folder, not a file",
        "bản quét {0} của {1} là thư mục, không phải tệp",
    ),
    (
        "mesh {} of {} is a web address",
        "bản quét {0} của {1} là địa chỉ web",
    ),
    (
        "mesh {} of {} cannot be read: {}",
        "không đọc được bản quét {0} của {1}: {2}",
    ),
    ("mesh {} of {} is {}", "bản quét {0} của {1} là {2}"),
    (
        "print {} of {} is a link to a file that does not exist",
        "bản in {0} của {1} là liên kết đến một tệp không tồn tại",
    ),
    (
        "print {} of {} does not exist",
        "không có bản in {0} của {1}",
    ),
    (
        "print {} of {} is a folder, not a file",
        "bản in {0} của {1} là thư mục, không phải tệp",
    ),
    (
        "print {} of {} is a web address",
        "bản in {0} của {1} là địa chỉ web",
    ),
    (
        "print {} of {} cannot be read: {}",
        "không đọc được bản in {0} của {1}: {2}",
    ),
    (
        "page {} of {} is a link to a file that does not exist",
        "trang in {0} của {1} là liên kết đến một tệp không tồn tại",
    ),
    (
        "page {} of {} does not exist",
        "không có trang in {0} của {1}",
    ),
    (
        "page {} of {} is a folder, not a file",
        "trang in {0} của {1} là thư mục, không phải tệp",
    ),
    (
        "page {} of {} is a web address",
        "trang in {0} của {1} là địa chỉ web",
    ),
    (
        "page {} of {} cannot be read: {}",
        "không đọc được trang in {0} của {1}: {2}",
    ),
    ("page {} of {} is {}", "trang in {0} của {1} là {2}"),
    (
        "labels {} of {} is a link to a file that does not exist",
        "nhãn {0} của {1} là liên kết đến một tệp không tồn tại",
    ),
    (
        "labels {} of {} does not exist",
        "không có nhãn {0} của {1}",
    ),
    (
        "labels {} of {} is a folder, not a file",
        "nhãn {0} của {1} là thư mục, không phải tệp",
    ),
    (
        "labels {} of {} is a web address",
        "nhãn {0} của {1} là địa chỉ web",
    ),
    (
        "labels {} of {} cannot be read: {}",
        "không đọc được nhãn {0} của {1}: {2}",
    ),
    ("labels {} of {} is {}", "nhãn {0} của {1} là {2}"),
    (
        "write its path without file://",
        "hãy viết đường dẫn không có file://",
    ),
    (
        "download the file and write the path of the copy",
        "hãy tải tệp về rồi ghi đường dẫn của bản đó",
    ),
    (
        "correct the paths, or use --allow-missing if the files are added before the run",
        "hãy sửa các đường dẫn",
    ),
    (
        "files of other kinds, nothing was imported:",
        "có tệp không đúng loại nên chưa nhập gì:",
    ),
    (
        "with the unit {}, the scan of {} is {} mm long, but its page {} mm by the resolution of the image",
        "với đơn vị {0}, bản quét của {1} dài {2#} mm, nhưng trang in của nó dài {3#} mm theo độ phân giải của hình",
    ),
    ("rename the file", "hãy đổi tên tệp"),
    ("{} is {}, not a list", "{0} là {1}, không phải danh sách"),
    ("{} is {}, not a file", "{0} là {1}, không phải tệp"),
    ("{} is a directory", "{0} là thư mục"),
    (
        "cannot read the temporary file of the list",
        "không đọc được tệp tạm của danh sách",
    ),
    (
        "cannot write a temporary file for the list",
        "không ghi được tệp tạm cho danh sách",
    ),
    ("too many open files", "có quá nhiều tệp đang mở"),
    (
        "the system has too many open files",
        "hệ thống có quá nhiều tệp đang mở",
    ),
    ("close other programs", "hãy đóng các chương trình khác"),
    ("{} is not a directory", "{0} không phải là thư mục"),
    ("there is no directory {}", "không có thư mục {0}"),
    ("there is no file {}", "không có tệp {0}"),
    // Files of folders.
    (
        "the folder of meshes holds images, and that of prints holds meshes",
        "thư mục bản quét chứa hình, và thư mục bản in chứa bản quét",
    ),
    (
        "all pairs are left out, so there is nothing to import",
        "mọi cặp đều bị bỏ qua nên không còn gì để nhập",
    ),
    (
        "there is no such mesh without a print",
        "không có bản quét này mà thiếu bản in",
    ),
    (
        "there is no such print without a mesh",
        "không có bản in này mà thiếu bản quét",
    ),
    (
        "{} holds no meshes, and {} no images",
        "{0} không có bản quét, và {1} không có hình",
    ),
    (
        "{} and {} have the same name, but their folders {} and {} differ",
        "{0} và {1} cùng tên, nhưng thư mục {2} và {3} của chúng khác nhau",
    ),
    (
        "give both one name, or name them scans and prints, or quét and in",
        "hãy đặt cùng một tên cho hai thư mục, hoặc đặt là scans và prints, hoặc quét và in",
    ),
    (
        "1 more mesh and print have similar names",
        "còn 1 bản quét và bản in có tên gần giống nhau",
    ),
    (
        "{} more meshes and prints have similar names",
        "còn {0#} cặp bản quét và bản in có tên gần giống nhau",
    ),
    (
        "{} and {} have similar names",
        "{0} và {1} có tên gần giống nhau",
    ),
    (
        "rename one if they are a pair",
        "nếu chúng là một cặp thì hãy đổi tên một tệp",
    ),
    (
        "{} has the same stem",
        "{0} có cùng tên không kể phần mở rộng",
    ),
    (
        "meshes are paired by stem",
        "bản quét được ghép theo phần tên này",
    ),
    (
        "prints are paired by stem",
        "bản in được ghép theo phần tên này",
    ),
    (
        "{} has the same id {} (upper and lower case are equal)",
        "{0} có cùng mã {1} (không phân biệt chữ hoa và chữ thường)",
    ),
    (
        "rename one of the meshes",
        "hãy đổi tên một trong các bản quét",
    ),
    (
        "rename one of the prints",
        "hãy đổi tên một trong các bản in",
    ),
    (
        "the files or the list changed after the pairs were shown",
        "các tệp hoặc danh sách đã thay đổi sau khi các cặp được hiện",
    ),
    (
        "nothing was imported: look at the pairs again",
        "chưa nhập gì: hãy xem lại các cặp",
    ),
    ("nothing was imported", "chưa nhập gì"),
    // Rows that known pairs and blocks contradict.
    (
        "pair {} differs from pair {} only in upper and lower case, so their files would be one on Windows and macOS",
        "cặp {0} chỉ khác cặp {1} ở chữ hoa và chữ thường, nên trên Windows và macOS tệp của chúng sẽ là một",
    ),
    (
        "block {} differs from block {} only in upper and lower case, so their files would be one on Windows and macOS",
        "ván {0} chỉ khác ván {1} ở chữ hoa và chữ thường, nên trên Windows và macOS tệp của chúng sẽ là một",
    ),
    (
        "nothing was imported, rename one of them",
        "chưa nhập gì, hãy đổi tên một trong hai",
    ),
    (
        "{} of the {} pairs in it that the project has would get another mesh and another print, such as {}: their ids may be those of others",
        "{0#} trong số {1#} cặp mà dự án đã có sẽ nhận bản quét và bản in khác, chẳng hạn {2}: có thể đây là mã của các cặp khác",
    ),
    (
        "{} of the {} blocks in it that the project has would get another scan and another page, such as {}: their ids may be those of others",
        "{0#} trong số {1#} ván mà dự án đã có sẽ nhận bản quét và trang in khác, chẳng hạn {2}: có thể đây là mã của các ván khác",
    ),
    (
        "nothing was imported, give other ids (of folders, import the one above, so that ids begin with the name of the folder)",
        "chưa nhập gì, hãy đặt mã khác (với thư mục, hãy nhập thư mục phía trên để mã bắt đầu bằng tên thư mục)",
    ),
    (
        "pair {} has the mesh and the print of pair {}, so a spreadsheet may have dropped the zeros of its id",
        "cặp {0} có bản quét và bản in của cặp {1}, nên có thể bảng tính đã bỏ các số 0 ở đầu mã",
    ),
    (
        "nothing was imported, write the id as {}",
        "chưa nhập gì, hãy ghi mã là {0}",
    ),
    (
        "the list was not read to its end, so nothing was imported",
        "danh sách chưa được đọc hết nên chưa nhập gì",
    ),
    (
        "blocks with the same scan and page as one of the project: {}, first {}, as {}",
        "số ván có cùng bản quét và trang in với một ván của dự án: {0#}, ván đầu tiên là {1}, giống {2}",
    ),
    (
        "pairs with the same mesh and print as an earlier one: {}, first {}, as {}",
        "số cặp có cùng bản quét và bản in với một cặp trước: {0#}, cặp đầu tiên là {1}, giống {2}",
    ),
    (
        "blocks with the same scan and page as an earlier one: {}, first {}, as {}",
        "số ván có cùng bản quét và trang in với một ván trước: {0#}, ván đầu tiên là {1}, giống {2}",
    ),
    // Values that the import empties.
    (
        "1 known pair loses its {}, empty or missing in this import: {}",
        "1 cặp đã có trong dự án bị mất giá trị ở cột {0} vì cột này trống hoặc không có trong lần nhập này: {1}",
    ),
    (
        "{} known pairs lose their {}, empty or missing in this import, first {}",
        "{0#} cặp đã có trong dự án bị mất giá trị ở cột {1} vì cột này trống hoặc không có trong lần nhập này, cặp đầu tiên là {2}",
    ),
    (
        "1 known block loses its {}, empty or missing in this import: {}",
        "1 ván đã có trong dự án bị mất giá trị ở cột {0} vì cột này trống hoặc không có trong lần nhập này: {1}",
    ),
    (
        "{} known blocks lose their {}, empty or missing in this import, first {}",
        "{0#} ván đã có trong dự án bị mất giá trị ở cột {1} vì cột này trống hoặc không có trong lần nhập này, ván đầu tiên là {2}",
    ),
    (
        "if that was not meant, import again with these values",
        "nếu không chủ ý thì hãy nhập lại với các giá trị này",
    ),
];
